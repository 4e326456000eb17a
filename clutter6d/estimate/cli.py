"""The command ``clutter6d estimate``."""

import os
from collections.abc import Callable
from typing import Annotated

import typer
from rich.console import Console
from rich.filesize import decimal
from rich.table import Column, Table

from clutter6d.assets.cli import find_source
from clutter6d.assets.named_libraries import open_library
from clutter6d.estimate.measurement import measure_assets, measure_scenes
from clutter6d.estimate.plan import StagePlan, UnitCost, plan_stage
from clutter6d.progress import progress_bars
from clutter6d.scenegen.track import find_track


def estimate(
    assets: Annotated[int, typer.Option(min=0, help="Assets to plan for.")] = 10_000,
    scenes: Annotated[int, typer.Option(min=0, help="Scenes to plan for.")] = 100_000,
    track: Annotated[str, typer.Option(help="Track of the scenes: sparse, moderate or dense.")] = "moderate",
    workers: Annotated[int, typer.Option(min=1, help="Workers to plan for, each on a core of its own.")] = 64,
    source: Annotated[str, typer.Option(help="Source of the assets, as in clutter6d assets process.")] = "procedural",
    library: Annotated[str, typer.Option(help="Library that the sampled scenes are made of.")] = "procedural",
    sample_assets: Annotated[int, typer.Option(min=2, help="Assets to measure.")] = 24,
    sample_scenes: Annotated[int, typer.Option(min=2, help="Scenes to measure.")] = 8,
    seed: Annotated[int, typer.Option(help="Seed of the sampled scenes.")] = 0,
) -> None:
    """Plan a large run: hours, cores and bytes, from unit costs measured here and now on a small sample."""
    console = Console(markup=False, emoji=False)
    costs: dict[str, UnitCost] = {}
    chosen_track = find_track(track)
    with progress_bars(console) as progress:
        if assets:
            chosen = find_source(source)
            total = min(sample_assets + 1, len(chosen.objects()))
            bar = progress.add_task(f"measuring {chosen.name} objects", total=total)
            costs["assets"] = measure_assets(chosen, sample_assets, lambda: progress.advance(bar))
        if scenes:
            made = progress.add_task("built-in objects (once)", total=None, visible=False)
            opened = open_library(
                library,
                on_progress=lambda done, total: progress.update(made, completed=done, total=total, visible=True),
            )
            bar = progress.add_task(f"measuring {track} scenes", total=sample_scenes + 1)
            costs["scenes"] = measure_scenes(opened, chosen_track, seed, sample_scenes, lambda: progress.advance(bar))
    wanted = {"assets": assets, "scenes": scenes}
    plans = {name: plan_stage(wanted[name], cost, workers) for name, cost in costs.items()}
    _print_costs(costs, {"assets": source, "scenes": track}, console)
    _print_plans(plans, workers, console)


def _print_costs(costs: dict[str, UnitCost], kinds: dict[str, str], console: Console) -> None:
    cores, load = len(os.sched_getaffinity(0)), os.getloadavg()[0]
    title = f"unit costs, measured now on one of {cores} cores (load {load:.1f})"
    table = Table("", *(Column(f"{kinds[name]} {name}", justify="right") for name in costs), title=title)
    rows: dict[str, Callable[[UnitCost], str]] = {
        "sample": lambda cost: str(len(cost.seconds)),
        "processor time, mean": lambda cost: f"{cost.mean_s:.3f} s",
        "the mean is good to": lambda cost: f"± {cost.error_share:.0%}",
        "median": lambda cost: f"{cost.median_s:.3f} s",
        "largest": lambda cost: f"{max(cost.seconds):.3f} s",
        "a worker's start": lambda cost: f"{cost.start_s:.1f} s",
        "tried that succeed": lambda cost: f"{cost.share:.0%}",
        "storing, one at a time": lambda cost: f"{1000 * cost.serial_s:.0f} ms" if cost.serial_s else "in the workers",
        "on disk": lambda cost: decimal(round(cost.bytes_each)),
    }
    for name, show in rows.items():
        table.add_row(name, *(show(cost) for cost in costs.values()))
    console.print(table)


def _print_plans(plans: dict[str, StagePlan], workers: int, console: Console) -> None:
    table = Table(
        "", *(Column(name, justify="right") for name in ("items", "tried", "core hours", "hours", "on disk")),
        title=f"plan for {workers} workers",
    )  # fmt: skip
    for name, plan in plans.items():
        table.add_row(
            name, f"{plan.items:,}", f"{plan.tried:,}", f"{plan.core_hours:,.2f}", f"{plan.hours:,.2f}",
            decimal(round(plan.bytes)),
        )  # fmt: skip
    total = [sum(getattr(plan, name) for plan in plans.values()) for name in ("core_hours", "hours", "bytes")]
    table.add_row("together", "", "", f"{total[0]:,.2f}", f"{total[1]:,.2f}", decimal(round(total[2])))
    console.print(table)
    for name, plan in plans.items():
        if plan.is_collector_bound:
            console.print(f"{name}: storing results is the limit; fewer workers would do.")
