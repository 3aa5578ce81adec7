"""What snapshots say of how their matter melts and boils on release: critical entropies of materials that take a
table, melting temperatures of those that have one (attribute ``release``), for the crater's report."""

from __future__ import annotations

from pathlib import Path

from sph.eos import dispatch, table
from sph.materials import temperature
from sph.materials.rows import Materials
from sph.materials.settings import AS_PUBLISHED, has_section, parameters
from sph.shock_states import isentropic_release

_TABLE = dispatch.FAMILY.kind("table")


def phase_thresholds(materials: Materials) -> dict[str, dict[str, float | str]]:
    """By material: ``melting_temperature_K``; of a table also ``boiling_temperature_K``, the entropies [J/(kg K)]
    ``melting_begins``, ``boiling_begins``, ``vapour`` (``sph.shock_states.isentropic_release``), the shock pressures
    [Pa] at which its own Hugoniot reaches them (``shock_..._Pa``), and the ``table``. Empty where no material has
    either."""
    found: dict[str, dict[str, float | str]] = {}
    for i, name in enumerate(materials.names):
        choice = materials.choices.get(name, AS_PUBLISHED)
        melting = float("inf")
        if has_section(name, "thermal", choice):
            melting = parameters(temperature.Parameters, name, "thermal", choice).melt_temperature
        facts: dict[str, float | str] = {"melting_temperature_K": melting} if melting < float("inf") else {}
        if materials.rows.eos[i] == _TABLE:
            chosen = parameters(table.Parameters, name, table.__name__.rpartition(".")[2], choice)
            critical = isentropic_release.entropies(chosen.file, melting)
            if critical:
                shocks = isentropic_release.shocks_of(chosen, critical)
                facts |= {**critical, **shocks, "table": Path(chosen.file).name}
        if facts:
            found[name] = facts
    return found
