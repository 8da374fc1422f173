"""What a joint may do now: torque and commands follow from its state, never from a message alone.

A pure step function. Its flags (enabled, fault, rest) block the joint each for itself; what it shows is the strongest
of them, else where it stands between unknown and active. Nothing resumes by itself: after each of them the joint is
relaxed, and the next command starts from where it is.
"""

from __future__ import annotations

import math
from dataclasses import replace

from rbxcompose.control.joint_states import (
    WITH_TORQUE,
    BringToRest,
    Enable,
    Hold,
    JointAction,
    JointCondition,
    JointInputs,
    JointMode,
    JointPolicy,
    JointRequest,
    MoveAt,
    MoveTo,
    Pursue,
    Refuse,
    Relax,
    TorqueOff,
    TorqueOn,
    WriteGoal,
)


def step_joint(
    state: JointCondition, inputs: JointInputs, now: float, policy: JointPolicy
) -> tuple[JointCondition, tuple[JointAction, ...]]:
    """Return the state after what is known at `now` [s], and what to do, in this order."""
    cycle = _Cycle(state, inputs, now, policy)
    cycle.observe()
    for request in inputs.requests:
        cycle.answer(request)
    return replace(cycle.state, note=cycle.note()), tuple(cycle.actions)


class _Cycle:
    """One step: the state as it changes, and the actions so far."""

    def __init__(self, state: JointCondition, inputs: JointInputs, now: float, policy: JointPolicy) -> None:
        self.inputs, self.now, self.policy = inputs, now, policy
        self.actions: list[JointAction] = []
        if _finite(inputs.position) is not None:
            state = replace(state, position=inputs.position, measured_at=inputs.measured_at)
        self.state = state
        self.position = state.position
        self.temperature = _finite(inputs.temperature)
        self.age = now - state.measured_at
        self.is_stale = self.age > policy.cycle * policy.hold_after

    def observe(self) -> None:
        """Take in what was measured: it counts before any request."""
        was_lost, is_known = self.state.is_lost, self.state.base is not JointMode.UNKNOWN
        self.state = replace(
            self.state,
            is_lost=(was_lost and self.is_stale) or (is_known and self.age > self.policy.fault_after),
            hardware_error=self.inputs.hardware_error or self.state.hardware_error,
            rest_until=self._rest_until(),
        )
        if self.state.is_lost:
            self._lose()
        elif self.state.is_blocked:
            self._block()
        elif self.is_stale:
            self._settle()
        elif self.state.base is JointMode.UNKNOWN:
            self._start("relax" if was_lost else self.policy.on_start)

    def answer(self, request: JointRequest) -> None:
        """Carry out a request, or refuse it with the reason."""
        reason = self._objection(request)
        if reason:
            self.actions.append(Refuse(request, reason))
            return
        match request:
            case Enable(on=True):
                self.state = replace(self.state, is_enabled=True, hardware_error="")
            case Enable():
                self.state = replace(self.state, is_enabled=False)
                self._switch_off()
            case Relax():
                self._switch_off()
            case Hold():
                self._hold()
            case MoveTo() | MoveAt():
                self._pursue(request)

    def note(self) -> str:
        """Return why the joint is as it is; empty if there is nothing to say."""
        warn = self.policy.thermal.warn
        warm = f"{self.temperature:g} degC is above {warn:g} degC" if (self.temperature or -math.inf) > warn else ""
        return self._block_reason() or self._age_reason() or warm

    def _rest_until(self) -> float | None:
        thermal, until = self.policy.thermal, self.state.rest_until
        if until is None:
            is_hot = self.temperature is not None and self.temperature > thermal.limit
            return self.now + thermal.rest if is_hot else None
        is_cool = self.temperature is not None and self.temperature <= thermal.resume
        return None if is_cool and self.now >= until else until

    def _lose(self) -> None:
        """Try to switch torque off; it is switched off again when the servo has come back, maybe with torque."""
        if self.state.base is not JointMode.UNKNOWN:
            self.actions.append(TorqueOff())
            self._become(JointMode.UNKNOWN)

    def _block(self) -> None:
        if self.state.base in WITH_TORQUE or (self.state.base is JointMode.UNKNOWN and not self.is_stale):
            self.actions.append(TorqueOff())
            self._become(JointMode.RELAXED)

    def _settle(self) -> None:
        """Let a joint that nobody sees come to rest."""
        if self.state.base is JointMode.ACTIVE:
            self.actions.append(BringToRest())
            self._become(JointMode.HOLDING)

    def _start(self, how: str) -> None:
        if how == "hold":
            self._hold()
        elif how == "relax":
            self.actions.append(TorqueOff())
            self._become(JointMode.RELAXED)

    def _switch_off(self) -> None:
        if self.state.base is JointMode.RELAXED:
            return
        self.actions.append(TorqueOff())
        if self.state.base in WITH_TORQUE:
            self._become(JointMode.RELAXED)

    def _hold(self) -> None:
        if self.state.base is JointMode.ACTIVE:
            self.actions.append(BringToRest())
        elif self.state.base is not JointMode.HOLDING:
            self._switch_on()
        self._become(JointMode.HOLDING)

    def _pursue(self, request: MoveTo | MoveAt) -> None:
        if self.state.base not in WITH_TORQUE:
            self._switch_on()
        self.actions.append(Pursue(request))
        self._become(JointMode.ACTIVE)

    def _switch_on(self) -> None:
        if self.position is not None:  # else the request was refused
            self.actions += [WriteGoal(self.position), TorqueOn()]

    def _become(self, base: JointMode) -> None:
        self.state = replace(self.state, base=base)

    def _objection(self, request: JointRequest) -> str:
        match request:
            case Enable(on=on):
                error = self.inputs.hardware_error
                return f"the servo still reports {error}" if on and error else ""
            case Relax():
                return ""
            case MoveTo(position=position) if not math.isfinite(position):
                return f"the position {position} is not a finite number"
            case MoveAt(velocity=velocity) if not math.isfinite(velocity):
                return f"the velocity {velocity} is not a finite number"
            case _:
                return self._block_reason() or self._age_reason()

    def _block_reason(self) -> str:
        state = self.state
        if not state.is_enabled:
            return "it is disabled"
        if state.hardware_error:
            return f"the servo reported {state.hardware_error}; enable the joint when that is mended"
        if state.is_lost:
            return f"nothing has been measured for {self.age:.2f} s"
        if state.rest_until is None:
            return ""
        resume, left = self.policy.thermal.resume, max(0.0, state.rest_until - self.now)
        heat = "its temperature is unknown" if self.temperature is None else f"it has {self.temperature:g} degC"
        return f"it was too hot and rests for {left:.0f} s, then until {resume:g} degC: {heat}"

    def _age_reason(self) -> str:
        if self.position is None:
            return "its position is not known"
        return f"its measured position is {self.age:.3f} s old" if self.is_stale else ""


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
