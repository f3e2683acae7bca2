"""One page: requests of the browser change its state, work is asked for, results are drawn.

What goes to the browser is a text: a JSON list of answers, each a name of `takes` in `page.js` with
its value, arrays as the bytes of their doubles. The browser tells when it has drawn pictures; until
then the newest result of each kind waits. So a fast engine does not flood a slow browser:
results that newer ones have replaced by then are not sent.
"""

from __future__ import annotations

import base64
import json
import logging
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl import units
from drillctl.design import Design, to_toml
from drillctl.design.paths import USUAL_NAMES, parameter
from drillctl.errors import DrillctlError, InputError
from drillctl.explorer import computed, controls, figures, form
from drillctl.explorer import state as states
from drillctl.explorer.work import Engine, Piece, Queue, Slices, Until

if TYPE_CHECKING:
    from drillctl.ensemble.grid import Axis
    from drillctl.explorer.computed import Picture, Share
    from drillctl.explorer.reports import Reports
    from drillctl.explorer.state import State

LOG = logging.getLogger("drillctl")
MOST_UNDONE = 200  # states that can be gone back to
LOOPS = 0.2  # time (s) between two pictures of the loop while the cross is dragged
PICTURES = {
    "map": "map", "boundary": "map", "audit": "map", "recommendation": "map", "map of A": "map",
    "response": "run", "response of A": "run", "loop": "loop", "loop of A": "loop",
}  # fmt: skip
"""Group of pictures that a kind of result is drawn in."""
AT_CROSS = [kind for kind, group in PICTURES.items() if group != "map"]


class Page:
    """A page from when it is opened until it is closed."""

    def __init__(
        self, send: Callable[[str], Any], soon: Callable[[Callable[[], None]], Any], base: Design,
        first: State, engine: Engine, reports: Reports,
    ) -> None:  # fmt: skip
        self._send, self._soon = send, soon  # to the browser; from a thread of work
        self._base, self._engine, self._reports = base, engine, reports
        self.state = first
        self._axes = first.grid(base.replace(first.settings))  # of the map that is shown
        self._history, self._undone = [self.state], list["State"]()
        self._said: list[dict[str, Any]] = []  # answers that are not sent yet
        self._drawing = self._asked_advice = False
        self._settled = True  # whether nothing is being dragged
        self._loop_is_rough, self._loop_at = False, -math.inf
        self._shown: dict[str, Any] = {}  # newest result of each kind
        # kinds that wait for the browser, with the request that each answers
        self._ready: dict[str, int] = {}
        self._count = 0
        self._owed = ""  # kind of the result that the newest request waits for

    # Messages.

    def take(self, text: str) -> None:
        """A request of the browser."""
        asked = json.loads(text)
        if asked["do"] == "drawn":
            self._drawing = False
            self._turn()
        else:
            self._turn(partial(self._answer, asked))

    def _turn(self, call: Callable[[], None] = lambda: None) -> None:
        """Do something, and send what it gives with the pictures that wait."""
        call()
        if self._ready and not self._drawing:
            ready, self._ready, self._drawing = self._ready, {}, True
            for kind in ready:
                self._tell(kind)
                self._pay(kind)
            if not ready.keys().isdisjoint(AT_CROSS):
                self._readouts()
            self._say(pictures=self._pictures({PICTURES[kind] for kind in ready}), drew=ready)
        if self._said:
            said, self._said = self._said, []
            self._send(json.dumps(said, default=_packed, allow_nan=False))

    def _later(self, call: Callable[[], None]) -> None:
        """Take a turn, from a thread of work."""
        try:
            self._soon(partial(self._turn, call))
        except RuntimeError:  # the server has ended meanwhile
            self._engine.drop(self)

    def _say(self, **answers: Any) -> None:
        self._said.append(answers)

    # Requests.

    def _answer(self, asked: dict[str, Any]) -> None:
        self._count, self._owed = asked.get("count", 0), ""
        try:
            self._do(asked)
        except DrillctlError as error:
            where = str(asked.get("path") or asked.get("name") or asked.get("do"))
            self._say(error={"at": where, "said": units.told(error.problem, self.state.units)
                             if isinstance(error, InputError) else str(error)})  # fmt: skip
        except Exception as error:  # a fault of the program is shown, and the page goes on
            LOG.exception("a request failed")
            self._say(error={"at": "", "said": f"{type(error).__name__}: {error}"})
        if self._settled or not self._owed:
            self._say(answered=self._count)

    def _do(self, asked: dict[str, Any]) -> None:
        action = asked["do"]
        own: dict[str, Callable[[], None]] = {
            "ready": self._begin, "save": self._save, "design": self._save_design,
            "commands": self._commands, "recommend": self._recommend, "report": self._report,
            "undo": partial(self._step, self._history, self._undone, 1),
            "redo": partial(self._step, self._undone, self._history, 0),
        }  # fmt: skip
        if action in own:
            own[action]()
            return
        self._take(states.changed(self.state, asked, self._base), asked.get("settled", True))
        self._say(fine=True)

    def _begin(self) -> None:
        self._describe()
        self._move()
        self._compute(None, self.state)
        self._ready["map"] = self._count

    def _step(self, source: list[State], target: list[State], left: int) -> None:
        """Move a state between what is shown and what was undone, unless all but `left` are."""
        self._settled = True
        if len(source) > left:
            target.append(source.pop())
            self._change(self._history[-1])

    def _take(self, new: State, settled: bool) -> None:
        """Show a new state; one that is settled can be gone back to."""
        self._settled = settled
        if settled and new != self._history[-1]:
            self._history = [*self._history, new][-MOST_UNDONE:]
            self._undone.clear()
        self._change(new)

    def _change(self, new: State) -> None:
        old, self.state = self.state, new
        if (new.axes, new.settings) != (old.axes, old.settings):
            self._axes = new.grid(self._base.replace(new.settings))
        if [a.path for a in new.axes] != [a.path for a in old.axes]:
            self._forget("map", "map of A")
        self._compute(old, new)
        if new.axes != old.axes:
            self._ready["map"] = self._count
        if _form(new) != _form(old):
            self._describe()
        else:  # while something is dragged, what moves with the cross alone
            told = (form.values(new, self._base) if self._settled
                    else form.crossed(new, self._axes))  # fmt: skip
            self._say(values=told, **self._undoable())
        self._move()

    def _save(self) -> None:
        name = f"{self._base.name}-explorer.json"
        self._say(file={"name": name, "text": states.saved(self.state, self._base)})

    def _save_design(self) -> None:
        design = self.state.at_cross(self._base)
        self._say(file={"name": f"{self._base.name}-explored.toml", "text": to_toml(design)})

    def _commands(self) -> None:
        self._say(commands={"map": states.command(self.state, self._base),
                            "run": states.run_command(self.state, self._base)})  # fmt: skip

    def _report(self) -> None:
        design = self.state.at_cross(self._base)
        self._say(report={"said": "Writing the report of this point ..."})
        self._reports.write(self, design, lambda said: self._later(lambda: self._say(report=said)))

    # Work.

    def _compute(self, old: State | None, new: State) -> None:
        """Ask for what a change makes necessary."""
        base = self._base
        mapped = old is None or _mapped(new) != _mapped(old)
        moved = mapped or old is None or new.cross != old.cross
        if old is not None and new.kept != old.kept:
            self._keep(new)
        elif old is not None and new.axes != old.axes:
            self._map_of_a(new)
        if mapped:
            design = new.design(base)
            self._map(design, new.grid(design), new)
        if old is not None and new.units != old.units:
            self._ready |= dict.fromkeys(self._shown, self._count)
        if moved:
            self._put("quick", "response", 0, computed.response(new.at_cross(base)))
        if (moved or self._loop_is_rough) and (self._settled or self._loop_is_due):
            slices = computed.loop(new.at_cross(base))
            self._loop_is_rough, self._loop_at = not self._settled, time.monotonic()
            rough = islice(slices, 1) if self._loop_is_rough else slices
            self._put("loops", "loop", 0, rough)

    @property
    def _loop_is_due(self) -> bool:
        return time.monotonic() - self._loop_at > LOOPS

    def _map(self, design: Design, axes: tuple[Axis, Axis], new: State) -> None:
        self._engine.checks.drop(self, "audit")
        self._engine.advice.drop(self, "recommendation")
        self._forget("audit", "boundary", "recommendation")
        self._say(chip={"text": "audit: waiting", "kind": "none"}, stale=self._asked_advice)
        if new.draws:
            work = computed.probability(design, axes, new.level, new.draws)
            self._engine.maps.drop(self, "map")
            self._put("shares", "map", 0, work)
        else:
            self._engine.shares.drop(self, "map")
            self._put("maps", "map", 0, computed.mapped(design, axes, new.measure))
        self._put("checks", "boundary", 0, computed.boundary(design, axes))

    def _forget(self, *kinds: str) -> None:
        for kind in kinds:
            self._shown.pop(kind, None)
            self._ready.pop(kind, None)

    def _keep(self, new: State) -> None:
        case = new.case_a(self._base)
        kinds = ("response of A", "loop of A", "map of A")
        if case is None:
            for kind in kinds:
                for queue in self._engine.queues:
                    queue.drop(self, kind)
            self._forget(*kinds)
            self._ready |= dict.fromkeys(kinds, self._count)
            return
        self._put("quick", "response of A", 1, computed.response(case))
        self._put("loops", "loop of A", 1, computed.loop(case))
        self._map_of_a(new)

    def _map_of_a(self, new: State) -> None:
        if new.kept is None:
            return
        try:
            of_a = replace(new, settings=new.kept.settings).design(self._base)
            work = computed.mapped(of_a, new.grid(of_a), "j1")
        except InputError:  # the law of A has not what these axes run over
            self._forget("map of A")
        else:
            self._put("maps", "map of A", 1, work)

    def _recommend(self) -> None:
        design = self.state.design(self._base)
        until = Until()
        self._asked_advice = True
        self._say(sentence={"text": "Searching for what to set ...", "old": True})
        work = computed.recommended(design, until)
        self._put("advice", "recommendation", 0, work, until)

    def _put(
        self, queue: str, kind: str, rank: int, slices: Slices, until: Until | None = None
    ) -> None:
        """Ask for work, in place of what was asked of its kind before."""
        until = until or Until()
        self._ready.pop(kind, None)
        target: Queue = getattr(self._engine, queue)
        count = self._count
        if kind in ("map", "response"):
            self._owed = self._owed or kind

        def deliver(value: Any) -> None:
            if value is not None:
                self._later(partial(self._offer, kind, count, until, value))

        def failed(error: Exception) -> None:
            self._later(partial(self._failed, kind, until, error))

        target.put(Piece(self, kind, rank, slices, deliver, failed, until))

    def _offer(self, kind: str, count: int, until: Until, value: Any) -> None:
        """A result, which is drawn as soon as the browser has drawn what it has."""
        if until.dropped:
            return
        self._shown[kind], self._ready[kind] = value, count
        if kind == "map" and not isinstance(value, computed.Share) and value.whole is not None:
            audit = Until()
            self._say(chip={"text": "audit: running", "kind": "none"})
            self._put("checks", "audit", 1, computed.audited(value.whole, audit), audit)
        if kind == "audit" and not self._asked_advice:  # once by itself, when nothing else waits
            self._recommend()

    def _pay(self, kind: str) -> None:
        """Answer a request that waits for this: what is dragged sends its newest place then."""
        if kind == self._owed and not self._settled:
            self._owed = ""
            self._say(answered=self._count)

    def _failed(self, kind: str, until: Until, error: Exception) -> None:
        if until.dropped:
            return
        if isinstance(error, DrillctlError):
            said = error.problem if isinstance(error, InputError) else str(error)
        else:
            LOG.error("%s failed", kind, exc_info=error)
            said = f"{type(error).__name__}: {error}"
        self._shown.pop(kind, None)
        self._pay(kind)
        said = units.told(said, self.state.units)
        if kind == "loop":
            self._ready[kind] = self._count
        if kind == "recommendation":
            self._say(sentence={"text": f"No recommendation: {said}", "old": False})
        elif kind == "audit":
            self._say(chip={"text": "audit failed", "kind": "check", "more": said})
        else:
            self._say(problem={"of": kind, "said": said})

    # Results.

    def _pictures(self, groups: set[str]) -> dict[str, Any]:
        got, system = self._shown.get, self.state.units
        made: dict[str, Any] = {}
        if "map" in groups:
            levels = self._base.tables.map.levels
            made["map"] = figures.stability(self._axes, system, got("map"), levels, self._marks())
        if "run" in groups and "response" in self._shown:
            made |= figures.of_run(self._shown["response"], got("response of A"), system)
        if "loop" in groups:
            made |= figures.of_loop(got("loop"), got("loop of A"))
        return made

    def _marks(self) -> Iterator[figures.Drawn]:
        """What is on the map beside its levels."""
        state, shown, system = self.state, self._shown, self.state.units
        if "map of A" in shown:
            kept = state.kept
            assert kept is not None
            design = self._base.replace(kept.settings)
            at = {path: parameter(design, path).parse(text) for path, text in kept.cross.items()}
            levels = self._base.tables.map.levels
            yield from figures.kept_levels(shown["map of A"], levels, self._on_map(at), system)
        if "boundary" in shown:
            yield from figures.bounded(shown["boundary"], system)
        if "audit" in shown:
            yield figures.checked(shown["audit"], self._axes, system)
        if "recommendation" in shown:
            best = shown["recommendation"].recommended
            law = best.design.tables.controller.law
            place = self._on_map(best.gains)
            if place and law == state.design(self._base).tables.controller.law:
                yield figures.starred(place)

    def _on_map(self, values: dict[str, float]) -> figures.Place | None:
        """Where values (SI, by path) are on the map, in the units that are shown."""
        if any(axis.path not in values for axis in self._axes):
            return None
        system = self.state.units
        x, y = (values[a.path] / controls.shown_unit(a.unit, system)[0] for a in self._axes)
        return x, y

    def _tell(self, kind: str) -> None:
        """What a result says in words."""
        one = self._shown.get(kind)
        if one is None:
            return
        if kind in ("map", "response", "loop"):
            self._say(problem={"of": kind, "said": ""})
        if kind == "map":
            self._tell_map(one)
        elif kind == "audit":
            worst = "" if one.worst is None else f", worst difference {one.worst:.1e}"
            text = f"audit: {one.verdict}, {len(one.cells)} cells{worst}"
            self._say(chip={"text": text, "kind": one.verdict, "more": one.sentence("cells")})
        elif kind == "recommendation":
            text = units.told(one.sentence, self.state.units)
            self._say(sentence={"text": text, "old": False, "verdict": one.verdict})

    def _tell_map(self, one: Picture | Share) -> None:
        if isinstance(one, computed.Share):
            said = (f"share of {one.draws} of {self.state.draws} rocks with J1 of "
                    f"{self.state.level:g} s or less")  # fmt: skip
            self._say(map={"whole": one.draws >= self.state.draws, "said": said},
                      chip={"text": f"{one.draws} rocks", "kind": "none"})  # fmt: skip
            return
        said = "coarse"
        if one.whole is not None:
            said = "no cell gives a finite answer"
            if one.whole.minimum is not None:
                value, at = one.whole.minimum
                where = ", ".join(
                    f"{USUAL_NAMES.get(a.path, a.path)} {units.full(at[a.path], a.unit or '1', 5)}"
                    for a in one.axes
                )
                said = units.told(f"least J1 {value:.4g} s at {where}", self.state.units)
        self._say(map={"whole": one.whole is not None, "said": said})

    def _readouts(self) -> None:
        """Send the table of numbers at the cross and of case A."""
        runs = [self._shown.get(kind) for kind in ("response", "response of A")]
        loops = [self._shown.get(kind) for kind in ("loop", "loop of A")]
        self._say(readouts=form.readouts(runs, loops, self.state.units))

    # The form.

    def _move(self) -> None:
        system = self.state.units
        units_of = (controls.shown_unit(one.unit, system)[0] for one in self._axes)
        self._say(cross=[at / one for at, one in zip(self.state.cross, units_of, strict=True)])

    def _undoable(self) -> dict[str, bool]:
        return {"undo": len(self._history) > 1, "redo": bool(self._undone)}

    def _describe(self) -> None:
        told = form.described(self.state, self._base)
        self._say(form=told, values=form.values(self.state, self._base), **self._undoable())

    def close(self) -> None:
        """Forget all of its work: the browser has left."""
        self._engine.drop(self)
        self._reports.drop(self)


def _packed(values: Any) -> dict[str, str]:
    doubles = np.asarray(values, dtype="<f8")
    return {"f8": base64.b64encode(doubles.tobytes()).decode("ascii")}


def _mapped(state: State) -> tuple[Any, ...]:
    """What the map depends on; the settings first."""
    rock = (state.draws, state.level) if state.draws else None
    return state.settings, state.axes, state.measure, rock


def _form(state: State) -> tuple[Any, ...]:
    """What the form depends on, beside the values in it."""
    laws = [state.settings.get(key) for key in ("controller.law", "weight_on_bit.law")]
    return state.axes, state.units, laws
