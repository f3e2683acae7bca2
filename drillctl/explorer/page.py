"""One page: requests of the browser change its state, work is asked for, results are drawn.

The browser tells when it has drawn what it was sent; until then the newest result of each kind
waits. So a fast engine does not flood a slow browser, and what is dropped nobody would have seen.
"""

from __future__ import annotations

import json
import logging
import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any

from bokeh.events import Pan, PanEnd, PanStart, Tap
from bokeh.models import ColumnDataSource, CustomJS

from drillctl import units
from drillctl.design import Design, to_toml
from drillctl.design.paths import USUAL_NAMES, parameter
from drillctl.errors import DrillctlError, InputError
from drillctl.explorer import computed, controls, form
from drillctl.explorer import state as states
from drillctl.explorer.figures import (
    LoopFigures,
    MapFigure,
    ResponseFigures,
    contours,
    shown,
)
from drillctl.explorer.work import Engine, Piece, Queue, Slices, Until

if TYPE_CHECKING:
    from bokeh.document import Document

    from drillctl.ensemble.audit import Audit
    from drillctl.ensemble.grid import Axis
    from drillctl.explorer.computed import Boundary, Loop, Picture, Share
    from drillctl.explorer.reports import Reports
    from drillctl.explorer.state import State
    from drillctl.simulation import Simulation
    from drillctl.studies.recommend.compute import Recommendation

LOG = logging.getLogger("drillctl")
MOST_UNDONE = 200  # states that can be gone back to
LOOPS = 0.2  # time (s) between two pictures of the loop while the cross is dragged
AHEAD = 1  # results sent that the browser has not drawn yet


class Page:
    """A page from when it is opened until it is closed."""

    def __init__(
        self, document: Document, base: Design, first: State, engine: Engine, reports: Reports
    ) -> None:
        self._document, self._base, self._engine, self._reports = document, base, engine, reports
        self.state = first
        self._axes = first.grid(base.replace(first.settings))  # of the map that is shown
        self._history, self._undone = [self.state], list["State"]()
        self.map, self.response, self.loop = MapFigure(), ResponseFigures(), LoopFigures()
        self._asked, self._answer = ColumnDataSource({"json": [""]}), ColumnDataSource({"json": []})
        self._drawn, self._sent = ColumnDataSource({"n": [0]}), ColumnDataSource({"n": [0]})
        self._said: list[str] = []  # answers that are not sent yet
        self._drawing = self._asked_advice = False
        self._settled = True  # whether nothing is being dragged
        self._loop_is_rough, self._loop_at = False, -math.inf
        self._ready: dict[str, Callable[[], None]] = {}  # results that wait for the browser
        self._shown: dict[str, Any] = {}  # newest result of each kind
        self._made_by: dict[str, int] = {}  # number of the request that it answers
        self._count = 0
        self._lay_out()

    # What the browser is given.

    def _lay_out(self) -> None:
        document = self._document
        for plot in (*self.map.plots, *self.response.plots, *self.loop.plots):
            document.add_root(plot)
        given = {
            "asked": self._asked, "answer": self._answer, "drawn": self._drawn, "sent": self._sent,
            "map": self.map.plot,
        }  # fmt: skip
        document.js_on_event(
            "document_ready", CustomJS(args=given, code="drillctl.start(asked, drawn)")
        )
        self._answer.js_on_change(
            "data", CustomJS(code="for (const one of cb_obj.data.json) drillctl.answer(one)")
        )
        self._sent.js_on_change("data", CustomJS(code="drillctl.drawing(cb_obj.data.n[0])"))
        for event, name in ((PanStart, "start"), (Pan, "move"), (PanEnd, "end"), (Tap, "end")):
            self.map.plot.js_on_event(
                event,
                CustomJS(args=given, code=f"drillctl.drag(cb_obj.x, cb_obj.y, '{name}', map)"),
            )
        self._asked.on_change("data", self._on_asked)
        self._drawn.on_change("data", self._on_drawn)
        document.title = f"{self._base.tables.title or self._base.name} - drillctl explorer"

    def _say(self, **answers: Any) -> None:
        """Send the browser what is not a picture, at once or with the pictures it belongs to."""
        self._say_later(**answers)
        if not self._drawing:
            self._send()

    def _say_later(self, **answers: Any) -> None:
        self._said.append(json.dumps(answers, allow_nan=False))

    def _send(self) -> None:
        self._answer.data, self._said = {"json": self._said}, []

    # Requests.

    def _on_asked(self, attribute: str, old: Any, new: Any) -> None:
        asked = json.loads(new["json"][0])
        self._count = asked.get("count", 0)
        try:
            self._do(asked)
        except DrillctlError as error:
            where = str(asked.get("path") or asked.get("name") or asked.get("do"))
            self._say(error={"at": where, "said": units.told(error.problem, self.state.units)
                             if isinstance(error, InputError) else str(error)})  # fmt: skip
        except Exception as error:  # the page survives what nobody thought of, and says it
            LOG.exception("a request failed")
            self._say(error={"at": "", "said": f"{type(error).__name__}: {error}"})
        self._say(answered=self._count)

    def _do(self, asked: dict[str, Any]) -> None:
        action = asked["do"]
        own = {
            "ready": self._begin, "undo": self._undo, "redo": self._redo, "save": self._save,
            "design": self._save_design, "commands": self._commands, "recommend": self._recommend,
            "report": self._report,
        }  # fmt: skip
        if action in own:
            own[action]()
            return
        self._take(states.changed(self.state, asked, self._base), asked.get("settled", True))
        self._say(fine=True)

    def _begin(self) -> None:
        self._place()
        self._describe()
        self._compute(None, self.state)

    def _undo(self) -> None:
        self._settled = True
        if len(self._history) > 1:
            self._undone.append(self._history.pop())
            self._change(self._history[-1])

    def _redo(self) -> None:
        self._settled = True
        if self._undone:
            self._history.append(self._undone.pop())
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
        if (new.axes, new.units, new.settings) != (old.axes, old.units, old.settings):
            self._place()
        if _form(new) != _form(old):
            self._describe()
        elif new == replace(old, cross=new.cross):
            self._say(values=form.crossed(new, self._axes), **self._undoable())
        else:
            self._say(values=form.values(new, self._base), **self._undoable())
        self._move()
        self._compute(old, new)
        if self._settled and "response" in self._shown:
            self._ready.setdefault("torques", partial(self._draw_torques, self._shown["response"]))
            self._draw_ready()

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
        self._reports.write(
            self, design, lambda said: self._next_tick(lambda: self._say(report=said))
        )

    # Work.

    def _compute(self, old: State | None, new: State) -> None:
        """Ask for what a change makes necessary."""
        base = self._base
        mapped = old is None or _mapped(new) != _mapped(old)
        moved = mapped or old is None or new.cross != old.cross or new.units != old.units
        if old is not None and new.kept != old.kept:
            self._keep(new, mapped=True)
        elif mapped and new.kept is not None:
            self._keep(new, mapped=old is None or _mapped(new)[1:] != _mapped(old)[1:])
        if mapped:
            design = new.design(base)
            self._map(design, new.grid(design), new)
        elif old is not None and new.units != old.units:
            self._paint_again()
        if moved:
            at = new.at_cross(base)
            self._put("quick", "response", 0, computed.response(at), self._draw_response)
        if (moved or self._loop_is_rough) and (self._settled or self._loop_is_due):
            slices = computed.loop(new.at_cross(base))
            self._loop_is_rough, self._loop_at = not self._settled, time.monotonic()
            rough = islice(slices, 1) if self._loop_is_rough else slices
            self._put("loops", "loop", 0, rough, self._draw_loop)

    @property
    def _loop_is_due(self) -> bool:
        return time.monotonic() - self._loop_at > LOOPS

    def _map(self, design: Design, axes: tuple[Axis, Axis], new: State) -> None:
        self._engine.checks.drop(self, "audit")
        self._engine.advice.drop(self, "recommendation")
        for kind in ("audit", "boundary", "recommendation"):
            self._shown.pop(kind, None)
            self._ready.pop(kind, None)
        self._say(chip={"text": "audit: waiting", "kind": "none"}, stale=self._asked_advice)
        self.map.check(None, axes, new.units)
        if new.draws:
            work = computed.probability(design, axes, new.level, new.draws)
            self._engine.maps.drop(self, "map")
            self._put("shares", "map", 0, work, self._draw_share)
        else:
            self._engine.shares.drop(self, "map")
            self._put("maps", "map", 0, computed.mapped(design, axes, new.measure), self._draw_map)
        self._put("checks", "boundary", 0, computed.boundary(design, axes), self._draw_boundary)

    def _keep(self, new: State, mapped: bool) -> None:
        case = new.case_a(self._base)
        if case is None:
            for kind in ("response of A", "loop of A", "map of A"):
                for queue in self._engine.queues:
                    queue.drop(self, kind)
                self._shown.pop(kind, None)
            self.response.keep(None, new.units)
            self.loop.keep(None)
            self.map.keep(None, None)
            self._readouts()
            return
        self._put("quick", "response of A", 1, computed.response(case), self._draw_response_of_a)
        self._put("loops", "loop of A", 1, computed.loop(case), self._draw_loop_of_a)
        assert new.kept is not None
        if not mapped:
            return
        try:
            of_a = replace(new, settings=new.kept.settings).design(self._base)
            work = computed.mapped(of_a, new.grid(of_a), "j1")
        except InputError:  # the law of A has not what these axes run over
            self.map.keep(None, None)
        else:
            self._put("maps", "map of A", 1, work, self._draw_map_of_a)

    def _recommend(self) -> None:
        design = self.state.design(self._base)
        until = Until()
        self._asked_advice = True
        self._say(sentence={"text": "Searching for what to set ...", "old": True})
        self._put(
            "advice", "recommendation", 0, computed.recommended(design, until),
            self._draw_sentence, until,
        )  # fmt: skip

    def _put(
        self, queue: str, kind: str, rank: int, slices: Slices, draw: Callable[[Any], None],
        until: Until | None = None,
    ) -> None:  # fmt: skip
        """Ask for work, in place of what was asked of its kind before."""
        until = until or Until()
        self._ready.pop(kind, None)
        target: Queue = getattr(self._engine, queue)
        count = self._count

        def deliver(value: Any) -> None:
            if value is not None:
                self._next_tick(partial(self._offer, kind, count, until, draw, value))

        def failed(error: Exception) -> None:
            self._next_tick(partial(self._failed, kind, until, error))

        target.put(Piece(self, kind, rank, slices, deliver, failed, until))

    def _next_tick(self, call: Callable[[], None]) -> None:
        try:
            self._document.add_next_tick_callback(call)
        except Exception:  # the page has closed meanwhile
            self._engine.drop(self)

    def _offer(
        self, kind: str, count: int, until: Until, draw: Callable[[Any], None], value: Any
    ) -> None:
        """Draw a result now, or once the browser has drawn what it has."""
        if until.dropped:
            return
        self._shown[kind], self._made_by[kind] = value, count
        self._ready[kind] = partial(draw, value)
        self._draw_ready()

    def _draw_ready(self) -> None:
        if not self._ready or self._sent.data["n"][0] - self._drawn.data["n"][0] >= AHEAD:
            return
        self._document.hold("combine")
        self._drawing = True
        kinds = dict(self._ready)
        self._ready.clear()
        try:
            for draw in kinds.values():
                draw()
        finally:
            self._drawing = False
            self._say_later(drew={kind: self._made_by.get(kind, 0) for kind in kinds})
            self._sent.data = {"n": [self._sent.data["n"][0] + 1]}
            self._send()
            self._document.unhold()

    def _on_drawn(self, attribute: str, old: Any, new: Any) -> None:
        self._draw_ready()

    def _failed(self, kind: str, until: Until, error: Exception) -> None:
        if until.dropped:
            return
        if isinstance(error, DrillctlError):
            said = error.problem if isinstance(error, InputError) else str(error)
        else:
            LOG.error("%s failed", kind, exc_info=error)
            said = f"{type(error).__name__}: {error}"
        self._shown.pop(kind, None)
        said = units.told(said, self.state.units)
        if kind == "loop":
            self.loop.show(None)
            self._readouts()
        if kind == "recommendation":
            self._say(sentence={"text": f"No recommendation: {said}", "old": False})
        elif kind == "audit":
            self._say(chip={"text": "audit failed", "kind": "check", "more": said})
        else:
            self._say(problem={"of": kind, "said": said})

    # Results.

    def _draw_map(self, one: Picture) -> None:
        state = self.state
        self._clear_old()
        self.map.paint(one.axes, one.values, self._levels(), state.measure, state.units, False)
        self._say(problem={"of": "map", "said": ""},
                  map={"whole": one.whole is not None, "said": self._map_said(one)})  # fmt: skip
        if one.whole is not None and len(one.whole.measures):
            until = Until()
            self._say(chip={"text": "audit: running", "kind": "none"})
            work = computed.audited(one.whole, until)
            self._put("checks", "audit", 1, work, self._draw_audit, until)

    def _clear_old(self) -> None:
        """Take what belongs to the map before off this one."""
        if "boundary" not in self._shown:
            self.map.mark(None, self.state.units)
        if "recommendation" not in self._shown:
            self.map.star(None)

    def _map_said(self, one: Picture) -> str:
        if one.whole is None:
            return "coarse"
        minimum = one.whole.minimum
        if minimum is None:
            return "no cell gives a finite answer"
        value, at = minimum
        where = ", ".join(
            f"{USUAL_NAMES.get(a.path, a.path)} {units.full(at[a.path], a.unit or '1', 5)}"
            for a in one.axes
        )
        return units.told(f"least J1 {value:.4g} s at {where}", self.state.units)

    def _levels(self) -> tuple[float, ...]:
        return self._base.tables.map.levels

    def _draw_share(self, one: Share) -> None:
        self._clear_old()
        self.map.paint(one.axes, one.values, (0.05, 0.5, 0.95), "j1", self.state.units, True)
        self._say(map={"whole": one.draws >= self.state.draws,
                       "said": f"share of {one.draws} of {self.state.draws} rocks with J1 of "
                               f"{self.state.level:g} s or less"},
                  chip={"text": f"{one.draws} rocks", "kind": "none"})  # fmt: skip

    def _draw_boundary(self, one: Boundary) -> None:
        self.map.mark(one, self.state.units)

    def _draw_audit(self, one: Audit) -> None:
        self.map.check(one, self._axes, self.state.units)
        worst = "" if one.worst is None else f", worst difference {one.worst:.1e}"
        text = f"audit: {one.verdict}, {len(one.cells)} cells{worst}"
        self._say(chip={"text": text, "kind": one.verdict, "more": one.sentence("cells")})
        if not self._asked_advice:  # once by itself, when nothing else waits for the machine
            self._recommend()

    def _draw_response(self, run: Simulation) -> None:
        self.response.show(run)
        self._say(problem={"of": "response", "said": ""})
        if self._settled:
            self._draw_torques(run)

    def _draw_torques(self, run: Simulation) -> None:
        """What is drawn when the cross rests: torques, and the numbers."""
        self.response.show_torques(run, self.state.units)
        self._readouts()

    def _draw_response_of_a(self, run: Simulation) -> None:
        self.response.keep(run, self.state.units)
        self._readouts()

    def _draw_loop(self, one: Loop) -> None:
        self.loop.show(one)
        self._say(problem={"of": "loop", "said": ""})
        self._readouts()

    def _draw_loop_of_a(self, one: Loop) -> None:
        self.loop.keep(one)
        self._readouts()

    def _draw_map_of_a(self, one: Picture) -> None:
        kept = self.state.kept
        assert kept is not None
        x, y = (shown(axis, self.state.units) for axis in one.axes)
        lines = contours(x, y, one.values, self._levels())
        design = self._base.replace(kept.settings)
        at = {path: parameter(design, path).parse(value) for path, value in kept.cross.items()}
        self.map.keep(lines, self._on_map(at))

    def _on_map(self, values: dict[str, float]) -> tuple[float, float] | None:
        """Where values (SI, by path) are on the map, in the units that are shown."""
        if any(axis.path not in values for axis in self._axes):
            return None
        system = self.state.units
        x, y = (values[a.path] / controls.shown_unit(a.unit, system)[0] for a in self._axes)
        return x, y

    def _draw_sentence(self, one: Recommendation) -> None:
        text = units.told(one.sentence, self.state.units)
        self._say(sentence={"text": text, "old": False, "verdict": one.verdict})
        law = one.recommended.design.tables.controller.law
        same = law == self.state.design(self._base).tables.controller.law
        self.map.star(self._on_map(one.recommended.gains) if same else None)

    def _paint_again(self) -> None:
        for kind, draw in (
            ("map", self._draw_share if self.state.draws else self._draw_map),
            ("boundary", self._draw_boundary), ("audit", self._draw_audit),
            ("map of A", self._draw_map_of_a), ("response of A", self._draw_response_of_a),
            ("recommendation", self._draw_sentence),
        ):  # fmt: skip
            if kind in self._shown:
                self._ready[kind] = partial(draw, self._shown[kind])
        self._draw_ready()

    def _readouts(self) -> None:
        """Send the table of numbers at the cross and of case A."""
        runs = [self._shown.get(kind) for kind in ("response", "response of A")]
        loops = [self._shown.get(kind) for kind in ("loop", "loop of A")]
        self._say(readouts=form.readouts(runs, loops, self.state.units))

    # The form.

    def _place(self) -> None:
        """Put the map where its axes are."""
        state = self.state
        self._axes = state.grid(self._base.replace(state.settings))
        self.map.place(self._axes, state.units)
        self._move()

    def _move(self) -> None:
        self.map.move(self.state.cross, self._axes, self.state.units)

    def _undoable(self) -> dict[str, bool]:
        return {"undo": len(self._history) > 1, "redo": bool(self._undone)}

    def _describe(self) -> None:
        told = form.described(self.state, self._base)
        self._say(form=told, values=form.values(self.state, self._base), **self._undoable())

    def close(self) -> None:
        """Forget all of its work: the browser has left."""
        self._engine.drop(self)
        self._reports.drop(self)


def _mapped(state: State) -> tuple[Any, ...]:
    """What the map depends on; the settings first."""
    rock = (state.draws, state.level) if state.draws else None
    return state.settings, state.axes, state.measure, rock


def _form(state: State) -> tuple[Any, ...]:
    """What the form depends on, beside the values in it."""
    laws = [state.settings.get(key) for key in ("controller.law", "weight_on_bit.law")]
    return state.axes, state.units, laws
