"""The rows of the ledger: what the handover keeps, and how well."""
