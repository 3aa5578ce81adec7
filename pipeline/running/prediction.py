"""``--check``: what a case will cost, before it runs; each stage predicts its own time, memory and disk."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from matter.case.body import Model
from pipeline.case import stages
from pipeline.running import room
from pipeline.running.request import Request
from pipeline.running.room import size
from pipeline.running.screen import duration
from pipeline.settings import sense

# how large the work of a later stage is depends on an earlier one: sizes by name, for the settings that have a field
# of that name
SIZES = ("particles", "grains", "snapshots", "bed_grains")
MEASURES = ("bed_step", "bed_radius")


def predictions(request: Request, settings: dict[str, Model]) -> dict[str, dict[str, float]]:
    """``wall_s``, ``memory_bytes`` and ``disk_bytes`` of each wanted stage (kernels compiled before)."""
    return {
        stage: {key: float(value) for key, value in row.items()}
        for stage, _, row in _in_order(request, settings)
        if stage in request.wanted
    }


def words(request: Request, settings: dict[str, Model]) -> str:
    """What is expected of the crater, and of each wanted stage its sizes and what its cost follows from."""
    lines = [text] if (text := sense.in_words(settings)) else []
    for stage, sized, _ in _in_order(request, settings):
        explain = (
            getattr(stages.load(stage), "explain", None) if sized is not None and stage in request.wanted else None
        )
        lines += [f"{stage}: {line}" for line in explain(sized)] if explain else []
    return "\n".join(lines)


def _in_order(request: Request, settings: dict[str, Model]) -> Iterator[tuple[str, Model | None, dict[str, float]]]:
    """Each stage with its settings, which know the sizes of the stages before it, and its prediction; without settings
    where its result is given."""
    sizes: dict[str, float] = {}
    if "bed" in settings and hasattr(settings["bed"], "count"):
        sizes["grains"] = settings["bed"].count
    for stage in stages.ORDER:
        if stage in request.case.outside:
            size = request.case.outside[stage].stat().st_size
            yield stage, None, {"wall_s": 0.1, "memory_bytes": 4.0 * size, "disk_bytes": float(size)}
        elif stage in settings:
            sized = _sized(settings[stage], sizes)
            row = stages.load(stage).predict(sized)
            sizes |= {name: int(row[name]) for name in SIZES if name in row} | {
                name: row[name] for name in MEASURES if name in row
            }
            yield stage, sized, row


def _sized(settings: Model, sizes: dict[str, float]) -> Model:
    """The settings with the sizes of the earlier stages, where the case does not state them itself."""
    fill = {
        name: count
        for name, count in sizes.items()
        if name in type(settings).model_fields and name not in settings.model_fields_set
    }
    return settings.model_copy(update=fill)


def table(request: Request, rows: dict[str, dict[str, float]], planned: Mapping[str, str]) -> str:
    """The predictions as a table, with what is ``planned`` for each stage, a total and a word on what this machine
    has."""
    lines = [f"{'stage':<12}{'time':>14}{'memory':>12}{'disk':>12}"]
    for stage, row in rows.items():
        origin = "from elsewhere, " if stage in request.case.outside else ""
        note = f"  {origin}{planned[stage]}" if stage in planned else ""
        lines.append(
            f"{stage:<12}{duration(row['wall_s']):>14}{size(row['memory_bytes']):>12}"
            f"{size(row['disk_bytes']):>12}{note}"
        )
    wall, disk = (sum(row[key] for row in rows.values()) for key in ("wall_s", "disk_bytes"))
    memory, most = room.needs(rows.values())
    lines.append(f"{'total':<12}{duration(wall):>14}{size(memory):>12}{size(disk):>12}")
    lines.append(
        f"times are for {threads()} and compiled kernels (a first run compiles for some minutes); memory is that of "
        f"the largest stage; checkpoints take {size(most - disk)} more disk during the run"
    )
    return "\n".join(lines + [f"WARNING: {text}" for text in room.short_of(memory, most, request.out)])


def threads() -> str:
    """The threads that predictions count on, in words."""
    import numba

    count = numba.get_num_threads()
    return "one thread" if count == 1 else f"{count} threads"
