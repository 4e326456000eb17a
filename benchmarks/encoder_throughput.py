"""How many clouds a second DAPL's encoder takes, beside the matrix products that its transformer cannot do without.

*Products* are the four linear layers of each block, without their biases, and the two products of its attention, of the
same shapes, one after the other; *tokens* is what comes before the transformer: patches, their points, their tokens. On
one thread, time is the processor's, on which other work has less influence.

    python benchmarks/encoder_throughput.py [--batches 64,256] [--rounds 15] [--threads 1,2] [--record]
"""

import argparse
from collections.abc import Callable, Sequence

import torch
from bars import bar
from machine import cores, processor_seconds_of, seconds_of
from tables import Report, add_record_option
from torch import Tensor
from torch.nn.functional import linear

from dapl_baselines.encoders.dapl import DaplEncoder, DaplEncoderConfig
from dapl_baselines.patches import CLOUD_FEATURES, CLOUD_POINTS, PATCHES, cut_into_patches

Types = {"float32": torch.float32, "bfloat16": torch.bfloat16}


def make_clouds(rows: int) -> Tensor:
    """Clouds of the size of real ones; how long they take does not depend on what they hold."""
    clouds = torch.randn(rows, CLOUD_POINTS, CLOUD_FEATURES, generator=torch.Generator().manual_seed(0))
    return 0.1 * clouds


def bare_products(config: DaplEncoderConfig, rows: int, dtype: torch.dtype) -> Callable[[], None]:
    """A call that does the matrix products of all blocks."""
    size, hidden = config.token_size, config.mlp_ratio * config.token_size
    tokens, wide = (torch.randn(rows * PATCHES, width, dtype=dtype) for width in (size, hidden))
    heads = torch.randn(rows * config.heads, PATCHES, size // config.heads, dtype=dtype)
    weights = torch.randn(rows * config.heads, PATCHES, PATCHES, dtype=dtype)
    into_heads, out_of_heads, up, down = (
        torch.randn(shape, dtype=dtype) for shape in ((3 * size, size), (size, size), (hidden, size), (size, hidden))
    )

    def run() -> None:
        for _ in range(config.blocks):
            linear(tokens, into_heads)
            torch.bmm(heads, heads.mT)
            torch.bmm(weights, heads)
            linear(tokens, out_of_heads)
            linear(tokens, up)
            linear(wide, down)

    return run


def seconds(rows: int, type_name: str, threads: int, rounds: int) -> dict[str, float]:
    """The fastest call of each contestant; they run in turns."""
    time_of = processor_seconds_of if threads == 1 else seconds_of
    torch.set_num_threads(threads)
    config, clouds, dtype = DaplEncoderConfig(), make_clouds(rows), Types[type_name]
    encoder = DaplEncoder(config).eval()
    calls = {
        "products": bare_products(config, rows, dtype),
        "encoder": lambda: encoder.encode(clouds),
        "tokens": lambda: encoder.tokenizer(clouds, cut_into_patches(clouds[..., :3])),
    }
    with torch.inference_mode(), torch.autocast("cpu", dtype=torch.bfloat16, enabled=dtype == torch.bfloat16):
        for call in calls.values():
            call()
        turns = [
            {name: time_of(call) for name, call in calls.items()}
            for _ in bar(range(rounds), f"batches of {rows}, {type_name}, threads: {threads}")
        ]
    return {name: min(turn[name] for turn in turns) for name in calls}


def cells(rows: int, taken: dict[str, float]) -> tuple[str, ...]:
    """A row of the table."""
    whole, products = taken["encoder"], taken["products"]
    times = f"{rows / whole:.0f}", f"{1e3 * products:.1f}", f"{1e3 * whole:.1f}"
    return *times, f"{whole / products:.2f}", f"{taken['tokens'] / whole:.0%}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--batches", default="64,256")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--threads", default=",".join(str(threads) for threads in sorted({1, cores()})))
    add_record_option(parser)
    options = parser.parse_args(arguments)
    report = Report("encoder_throughput")
    report.say(f"torch {torch.__version__}; fastest of {options.rounds} calls in turns.")
    for threads in (int(count) for count in options.threads.split(",")):
        columns = "clouds/s", "products, ms", "encoder, ms", "encoder/products", "tokens/encoder"
        report.head(f"clouds at once, threads: {threads}", *columns)
        for rows in (int(batch) for batch in options.batches.split(",")):
            for name in Types:
                report.row(f"{rows}, {name}", *cells(rows, seconds(rows, name, threads, options.rounds)))
    report.keep(options.record)


if __name__ == "__main__":
    main()
