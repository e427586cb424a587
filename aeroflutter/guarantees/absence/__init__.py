"""Where nothing can oscillate: a search, its certificate, and a checker that trusts neither."""

from aeroflutter.guarantees.absence.certificate import Certificate, Joint, Piece
from aeroflutter.guarantees.absence.interval import Absence, absence, absence_at
from aeroflutter.guarantees.absence.law import Uncovered, concerns
from aeroflutter.guarantees.absence.several import Several, several_at

__all__ = [
    "Absence",
    "Certificate",
    "Joint",
    "Piece",
    "Several",
    "Uncovered",
    "absence",
    "absence_at",
    "concerns",
    "several_at",
]
