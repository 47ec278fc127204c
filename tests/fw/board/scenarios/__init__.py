"""The scenarios. Each states what must hold; docs/board.md says why."""

from .event import event_bi, event_bi_chip, event_uni, watchdog_in_event
from .guard import restart_loop, restart_loop_deaf
from .measurement import chip, exact, jitter, phase_step, phase_step_chip
from .orders import busy, in_an_event, limits, settings_full, settings_stay
from .start import clock_wrap, crystal_fails, dead_crystal, mains_gone, no_car, no_mains, start, stopped
from .update import misfit, power_cuts, update

SCENARIOS = {
    "start": start, "no-car": no_car, "no-mains": no_mains, "mains-gone": mains_gone, "dead-crystal": dead_crystal,
    "crystal-fails": crystal_fails, "stopped": stopped, "event": event_uni, "event-bidirectional": event_bi, "event-bidirectional-ade7953": event_bi_chip,
    "watchdog-in-event": watchdog_in_event, "phase-step": phase_step, "phase-step-ade7953": phase_step_chip,
    "exact-50": exact, "jitter": jitter, "misfit": misfit, "ade7953": chip, "limits": limits,
    "in-an-event": in_an_event, "settings-stay": settings_stay, "settings-full": settings_full, "update": update,
    "busy": busy, "power-cuts": power_cuts, "clock-wrap": clock_wrap, "restart-loop": restart_loop,
    "restart-loop-deaf": restart_loop_deaf,
}
