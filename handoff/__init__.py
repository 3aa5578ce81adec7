"""Stage 4: from a shock-physics cloud to a settled granular bed, with a ledger of what was kept."""
