"""Equations of the typical section: built with SymPy, proved, and emitted as NumPy modules.

Run ``python -m derive`` to rebuild ``generated/`` and ``docs/derivation.md``, and
``python -m derive --check`` to compare what is committed with what the derivation gives.
"""
