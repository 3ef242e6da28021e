"""The lessons of the documentation: as notebooks, with checks that say what is wrong."""

from chaincor.workflows.lessons.begin import begin as begin
from chaincor.workflows.lessons.check import check as check
from chaincor.workflows.lessons.pages import prepared as prepared
