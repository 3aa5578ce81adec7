"""The late stage: grains from the handover to rest, with flight and escape."""
