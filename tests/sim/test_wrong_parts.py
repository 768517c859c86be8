"""Wrong parts stand where the right ones should, and can be told from them."""

import numpy as np
import pytest

from aoicell.nominal import Nominal
from aoicell.sim.board_geometry import component_parts
from aoicell.sim.wrong_parts import wrong_part

GREY = np.array([0.299, 0.587, 0.114, 0])


def test_every_wrong_part_is_in_its_place_and_looks_different(nominal: Nominal) -> None:
    rng = np.random.default_rng(0)
    for c in nominal.board.components:
        part, detail = wrong_part(nominal.board, c, rng)
        assert (part.id, part.x, part.y, part.z, part.rotation) == (c.id, c.x, c.y, c.z, c.rotation)
        assert part.width <= c.width
        assert part.depth <= c.depth
        assert part.height <= c.height
        assert detail
        now, then = component_parts(part), component_parts(c)
        printed = any(p.printed for p in then)
        assert part.label != c.label if printed else now != then, c.id


@pytest.mark.parametrize("seed", range(20))
def test_a_wrong_lamp_shows_in_a_grey_picture(nominal: Nominal, seed: int) -> None:
    for lamp in (c for c in nominal.board.components if c.kind == "led"):
        part, _ = wrong_part(nominal.board, lamp, np.random.default_rng(seed))
        lens = [component_parts(c)[-1].rgba @ GREY for c in (lamp, part)]
        assert abs(lens[0] - lens[1]) >= 0.15


def test_resistor_and_ceramic_capacitor_are_taken_for_each_other(nominal: Nominal) -> None:
    rng = np.random.default_rng(0)
    assert wrong_part(nominal.board, nominal.board.component("R1"), rng)[0].kind == "capacitor"
    assert wrong_part(nominal.board, nominal.board.component("C44"), rng)[0].kind == "resistor"
    can = nominal.board.component("C1")
    part, _ = wrong_part(nominal.board, can, rng)
    assert (part.kind, part.width) == ("capacitor", pytest.approx(0.8 * can.width))
