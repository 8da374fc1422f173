"""Carries out what the supervisor orders about live settings."""

from __future__ import annotations

from dataclasses import replace

from rbxcompose.config import Config
from rbxcompose.plan.dump import dump
from rbxcompose.requests import Refused
from rbxcompose.runtime import channel as say
from rbxcompose.runtime import setting_messages as tell
from rbxcompose.runtime.process_group.host import Host


def change_settings(host: Host, order: tell.SettingOrder, channel: say.Channel) -> None:
    """Carry out an order, and answer it."""
    changes = host.parameters.changes
    match order:
        case tell.PrepareChange():
            channel.send(_prepared(host, order))
        case tell.CommitChange(number):
            channel.send(tell.ChangeFollowed(number, changes.commit(number)))
        case tell.UndoChange(number):
            channel.send(tell.ChangeFollowed(number, changes.undo(number)))
        case tell.EndChange(number):
            changes.end(number)
        case tell.ChangeDecided(number, refusal):
            host.parameters.decided(number, refusal)


def _prepared(host: Host, order: tell.PrepareChange) -> tell.ChangePrepared:
    changes = host.parameters.changes
    try:
        found = changes.prepare(order.number, order.wanted)
    except Refused as refusal:
        return tell.ChangePrepared(order.number, str(refusal))
    new = {one.hosted.instance.name: one.new for one in found if one.is_ruled}
    return tell.ChangePrepared(order.number, "", _text(host, changes.live), _text(host, new))


def _text(host: Host, configs: dict[str, Config]) -> str:
    """Return configurations of components as a plan in text; empty if there are none."""
    instances = tuple(replace(host.hosted[name].instance, config=config) for name, config in configs.items())
    return dump(replace(host.plan, instances=instances), reveals_secrets=True) if instances else ""
