"""Extreme scenes: is every result right, or refused with a clear message?"""
