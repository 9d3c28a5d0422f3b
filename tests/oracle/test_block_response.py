"""The response of blocks against finite elements: triangles of second order of another library."""

import numpy as np
import pytest
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from stiction.elasticity.blocks import Pushes, block_response

LENGTH, HEIGHT, NODES = 0.11, 0.047, 220  # m
PUSHES = Pushes(("left",), height=0.02, width=0.012)


class Elements:
    """A block of triangles, finer towards its four corners and its side."""

    def __init__(self, nu: float, plane: str) -> None:
        young = 2.0 * (1.0 + nu)  # G = 1
        if plane == "stress":  # the strain that has the same plane stiffness
            young, nu = young * (1.0 + 2.0 * nu) / (1.0 + nu) ** 2, nu / (1.0 + nu)
        t = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, 33))
        ends = np.array(
            [PUSHES.height - 0.5 * PUSHES.width, PUSHES.height + 0.5 * PUSHES.width]
        )
        y = np.unique(np.concatenate([HEIGHT * t, ends]))
        mesh = skfem.MeshTri.init_tensor(LENGTH * t, y).with_boundaries(
            {
                "interface": lambda x: x[1] == 0.0,
                "top": lambda x: x[1] == HEIGHT,
                "pushed": lambda x: (x[0] == 0.0) & (x[1] > ends[0]) & (x[1] < ends[1]),
            }
        )
        self.element = skfem.ElementVector(skfem.ElementTriP2())
        self.basis = skfem.Basis(mesh, self.element)
        self.matrix = skfem.asm(linear_elasticity(*lame_parameters(young, nu)), self.basis)
        self.side = skfem.FacetBasis(mesh, self.element, facets="pushed")

    def solve(self, given, force=None):
        """Displacement with some components given on boundaries, as functions of x."""
        u = self.basis.zeros()
        fixed = []
        for (name, component), value in given.items():
            dofs = self.basis.get_dofs(name).all([component])
            u[dofs] = value(self.basis.doflocs[0, dofs])
            fixed.append(dofs)
        load = self.basis.zeros() if force is None else force
        return skfem.solve(*skfem.condense(self.matrix, load, x=u, D=np.concatenate(fixed)))

    def push(self):
        """Nodal forces of a unit force on the side."""
        form = skfem.LinearForm(lambda v, w: v[0] / PUSHES.width)
        return skfem.asm(form, self.side)


def crooked(x):
    x = x / LENGTH
    return np.exp(-(((x - 0.3) / 0.2) ** 2)) + 0.4 * np.cos(7.0 * x)


STUCK, STILL = {("interface", "u^1"): np.zeros_like}, {("top", "u^2"): np.zeros_like}
SLID = {("interface", "u^1"): lambda x: 0.5 * crooked(x)}
DX = LENGTH / NODES
SLIP = crooked((np.arange(NODES) + 0.5) * DX)


@pytest.fixture(params=[(0.35, "stress"), (0.45, "strain")], ids=lambda p: f"{p[0]}-{p[1]}")
def material(request):
    nu, plane = request.param
    kappa = 3.0 - 4.0 * nu if plane == "strain" else (3.0 - nu) / (1.0 + nu)
    return kappa, Elements(nu, plane)


def test_a_platen(material):
    kappa, elements = material
    response = block_response(LENGTH, NODES, HEIGHT, 1.0, kappa, None)
    moved = elements.solve(STUCK | STILL | {("top", "u^1"): np.ones_like})
    slid = elements.solve(SLID | STILL | {("top", "u^1"): np.zeros_like})
    # Elements are too stiff, by 1e-4 with this mesh, whose corners are singular.
    assert response.drive_stiffness == pytest.approx(moved @ elements.matrix @ moved, rel=3e-4)
    traction = response.drive_stiffness / LENGTH * response.shear
    force = 0.5 * DX * traction @ SLIP  # that holds the platen
    energy = 0.5 * DX * SLIP @ response.stiffness @ SLIP + force**2 / response.drive_stiffness
    assert energy == pytest.approx(slid @ elements.matrix @ slid, rel=3e-4)
    assert force == pytest.approx(-(moved @ elements.matrix @ slid), rel=3e-4)


def test_a_pusher(material):
    kappa, elements = material
    response, push = block_response(LENGTH, NODES, HEIGHT, 1.0, kappa, PUSHES), elements.push()
    pushed, slid = elements.solve(STUCK | STILL, push), elements.solve(SLID | STILL)
    # The displacement below a push that ends abruptly converges slowly.
    assert 1.0 / response.drive_stiffness == pytest.approx(push @ pushed, rel=1e-3)
    energy = 0.5 * DX * SLIP @ response.stiffness @ SLIP
    assert energy == pytest.approx(slid @ elements.matrix @ slid, rel=3e-4)
    assert 0.5 * DX / LENGTH * response.shear @ SLIP == pytest.approx(push @ slid, rel=3e-4)
