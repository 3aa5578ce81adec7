"""Pictures and report of the handover."""
