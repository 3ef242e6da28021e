"""The lessons of the documentation: as notebooks, with checks that say what is wrong."""

from chaincor.workflows.lessons.begin import begin as begin
from chaincor.workflows.lessons.begin import prepared as prepared
from chaincor.workflows.lessons.exercise import check as check
