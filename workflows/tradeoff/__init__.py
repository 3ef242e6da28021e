"""The trade between speed and accuracy of one collision, measured on this machine."""
