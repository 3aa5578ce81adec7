"""The table ``[inverse]`` of a case file, or of a file of its own beside ``[sweep]``: what was observed, and by which
model the priors of ``[sweep] kind = "prior"`` are held against it (``run_case CASE --invert``)."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, field_validator

from matter.case.body import Model

DISCREPANCY = {"diameter": 0.08, "": 0.15}
"""Scale of the discrepancy where a file gives none: of diameters, and of all else."""


class InverseTable(Model):
    """From an observed crater to what made it; it takes effect with ``run_case CASE --invert``."""

    model: Literal["sweep", "pi_scaling"] = "sweep"
    """``sweep``: the finished members of ``[sweep]``; ``pi_scaling``: scaling laws in their place, for planning, in
    seconds. They give ``diameter_apparent_m`` alone."""
    observed: dict[str, Any]
    """Measure -> ``["14.5 m", "0.8 m"]``, its value and standard error, ``["14.5 m", "0.5 m", "0.8 m"]`` where the
    lower and the upper error differ, or the name of an observed crater that has it. ``depth_m`` is the depth of the
    final crater; give other columns of the sweep's table by their full name, ``transient/depth_m``."""
    discrepancy: dict[str, float] = Field(default_factory=dict)
    """Measure -> how far the model itself may be off, as a fraction: the scale of a half-normal prior. By default 0.08
    for diameters and 0.15 for all else."""

    @field_validator("observed")
    @classmethod
    def _says_something(cls, table: dict[str, Any]) -> dict[str, Any]:
        if not table:
            raise ValueError('nothing is observed: diameter_apparent_m = ["14.5 m", "0.8 m"], for example')
        for name, entry in table.items():
            full = isinstance(entry, list | tuple) and len(entry) in (2, 3)
            if not isinstance(entry, str) and not (
                full and all(isinstance(one, int | float | str) and not isinstance(one, bool) for one in entry)
            ):
                raise ValueError(
                    f"{name}: a value with its standard error, or with one below and one above it, or the name of an "
                    f"observed crater"
                )
        return table

    @field_validator("discrepancy")
    @classmethod
    def _is_a_fraction(cls, table: dict[str, float]) -> dict[str, float]:
        for name, scale in table.items():
            if not 0.0 <= scale < 1.0:
                raise ValueError(f"{name}: a fraction from 0 to below 1 (given: {scale:g})")
        return table

    def scale(self, measure: str) -> float:
        """The scale of a measure's discrepancy."""
        kind = "diameter" if "diameter" in measure else ""
        return self.discrepancy.get(measure, DISCREPANCY[kind])
