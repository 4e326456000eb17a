"""What is said of the moment that is shown, line by line; a tab parts label and value."""

from math import degrees

from clutter6d.physics import CONTROL_STEP_S
from clutter6d.play.live_episode import REWARD_TERMS, Frame
from clutter6d.play.session import PlaySession


def describe(session: PlaySession) -> str:
    """Episode, step, errors, reward and outcome of what a session shows."""
    chosen, frame, config = session.selection, session.frame, session.playlist.config.termination
    lines = [
        ("policy", session.playlist.title),
        ("scene", chosen.scene_id),
        ("pair", f"{chosen.pair}  (episode {chosen.number + 1} of {chosen.count})"),
        ("step", f"{frame.step} of {config.max_steps}  ({frame.step * CONTROL_STEP_S:.1f} s)"),
        ("position", f"{100 * frame.position_m:.1f} cm  (success below {100 * config.position_tolerance_m:g})"),
        (
            "rotation",
            f"{degrees(frame.rotation_rad):.1f}°  (success below {degrees(config.rotation_tolerance_rad):.1f})",
        ),
        ("reward", f"{frame.reward['total']:.2f}"),
        ("terms", ", ".join(f"{name} {frame.reward[name]:.2f}" for name in REWARD_TERMS[:-1])),
        ("outcome", _outcome(session, frame)),
    ]
    recorded = session.recorded_row
    if recorded:
        stands = ", held" if recorded.holds else ", not held" if recorded.is_success else ""
        lines.append(("recorded", f"{recorded.outcome}{stands} after {recorded.steps} steps"))
    return "\n".join(f"{label}\t{value}" for label, value in lines)


def _outcome(session: PlaySession, frame: Frame) -> str:
    if frame.outcome is None:
        thinking = "; a policy that plans ahead may take a minute" if frame.step == 0 else ""
        return f"playing{thinking}" if session.is_playing else "paused"
    if frame.outcome != "success":
        return frame.outcome
    stands = {None: "holding for 1 s", True: "still stands 1 s later", False: "does not stand 1 s later"}
    return f"success, {stands[frame.holds]}"
