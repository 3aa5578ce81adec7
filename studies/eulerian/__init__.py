"""A grid code about an axis, independent of the shock stage: what ``../isobaric_core.py`` holds that stage against."""
