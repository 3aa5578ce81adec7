"""What a sweep costs before it runs: each stage once for all members that want the same.

Members want the same stage when the settings that decide it, and those of the stages that it reads, are equal. A stage
that reads one small file of an earlier one (the bed reads the body) may turn out to be the same in more members than
that says: the cost is an upper bound.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass

from matter.case.identity_fields import identity_fields
from pipeline.case import stages
from pipeline.running import plan, prediction
from pipeline.running.request import settings_of
from pipeline.sweeps.sweep import Sweep


@dataclass
class Row:
    """A stage of a sweep: how many ``members`` have it, how often it is to be ``made``, and what that takes [s]."""

    members: int = 0
    made: int = 0
    wall_s: float = 0.0


def rows_of(sweep: Sweep) -> dict[str, Row]:
    """A row per stage, in their order; members that were computed elsewhere cost nothing."""
    rows: dict[str, Row] = {}
    counted = set()
    for member, request in sweep.requests.items():
        if member in sweep.elsewhere:
            continue
        settings = settings_of(request)
        costs = prediction.predictions(request, settings)
        planned = plan.plan(request, settings)
        names: dict[str, str] = {}
        for stage in stages.ORDER:
            if stage not in costs:
                continue
            row = rows.setdefault(stage, Row())
            row.members += 1
            read = [names.get(item.partition("/")[0], "") for item in stages.READS[stage]]
            own = (
                str(request.case.outside[stage].resolve())
                if stage in request.case.outside
                else identity_fields(settings[stage])
            )
            decides = json.dumps([stage, own, read], sort_keys=True, default=str)
            names[stage] = hashlib.sha256(decides.encode()).hexdigest()
            there = planned.get(stage, plan.MADE)
            if names[stage] not in counted and not there.startswith((plan.HERE, plan.STORED)):
                counted.add(names[stage])
                row.made += 1
                row.wall_s += costs[stage]["wall_s"]
    return {stage: rows[stage] for stage in stages.ORDER if stage in rows}
