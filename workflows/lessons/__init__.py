"""Provide the notebooks and exercises of the lessons, and check answers."""

from chaincor.workflows.lessons.begin import begin as begin
from chaincor.workflows.lessons.begin import prepared as prepared
from chaincor.workflows.lessons.begin import show_figure as show_figure
from chaincor.workflows.lessons.exercise import check as check
from chaincor.workflows.lessons.script_check import check_script as check_script
