from dataclasses import replace

from dapl_baselines.teleop.status import Status, to_line, to_page

STATUS = Status(
    scene_id="dense-2-00005",
    pair=0,
    number=3,
    total=10,
    step=57,
    max_steps=300,
    position_error_m=0.1234,
    rotation_error_rad=0.5,
    phase="driving",
)


def test_the_line_says_what_the_person_needs_to_know():
    assert to_line(STATUS) == "DRIVING | 243 steps left | 12.3 cm, 29° to the goal"
    assert to_line(replace(STATUS, phase="ready")).startswith("READY: Enter starts")
    assert to_line(replace(STATUS, phase="paused")).startswith("PAUSED: Enter goes on")


def test_the_page_lists_the_thresholds_and_the_keys():
    page = to_page(replace(STATUS, phase="paused", note="the gamepad is gone"), ("left stick\tmoves",))
    rows = dict(line.split("\t") for line in page.splitlines())
    assert rows["PAUSED: Enter goes on"] == "the gamepad is gone"
    assert rows["to the goal"] == "12.3 cm, 29° (success below 5 cm, 5.7°)"
    assert rows["steps left"] == "243 of 300"
    assert rows["left stick"] == "moves"
    assert rows["Backspace"] == "give up, twice"
