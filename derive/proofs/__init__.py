"""Proofs of the steps of the derivation; they run before anything is emitted."""
