"""K - W on an interface by fast Fourier transforms: products, linear solver, eigenvectors.

Problem
-------
K is given by its symbol (`protocol`), W >= 0 is the weakening rate at
each node (Pa/m), and A = K - diag(W). `inside` marks a set S of nodes,
and x is zero outside S. Two problems are solved without a matrix in
memory:

    (A + spring phi phi')_SS x_S = right_S,                          (1)
    A_SS y_S = lambda y_S  for the smallest lambda, |y| = 1.         (2)

In (1) a spring (stiffness in Pa/m) may hold a patch phi (|phi| = 1).
With a stiff spring the matrix is positive definite even if A has a
single direction with negative curvature, close to phi. In this way,
states at and beyond the turning point of the load can be computed
(`turning_point`). Kernels take flat arrays, so that the same code
serves lines and planes.

Algorithm for (1), `solve_inside`
---------------------------------
Preconditioned conjugate gradients (J. Nocedal and S. Wright, Numerical
Optimization, 2006, algorithm 5.3) with the textbook's r, alpha and
beta. z is the preconditioned residual.

1. Precondition the residual: z = M r, restricted to S. M is 1/(K(k) +
   W/2) on Fourier modes, with the mean W. If a soft mode y is given,
   with y'Ay about 1, add y y' to M. Close to a turning point, one
   eigenvalue of A is much smaller than the others. If y is its
   eigenvector, no extra iterations are needed.
2. The new direction is z + beta times the previous direction. Multiply
   it by the matrix.
3. If the curvature along the direction is not positive, stop: A is not
   positive definite on S.
4. Step to the minimum along the direction, and go to step 1. Stop when
   no residual exceeds the tolerance.

Departure: the residual is measured by its largest entry, which is a stress.

Algorithm for (2), `lowest_eigenvector`
---------------------------------------
LOBPCG with a single vector (A. Knyazev, SIAM Journal on Scientific
Computing 23, 2001).

1. The vector x has the Rayleigh quotient lambda = x'Ax. Stop if |A x -
   lambda x| is small.
2. Make x, the preconditioned residual and the last direction orthonormal.
3. Solve the eigenproblem in the space of these three. The combination
   with the smallest lambda is the next x. Its part without x is the
   next direction. Go to step 1.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rocket_fft import c2c, c2r, r2c

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_allocating, jit_inside
from stiction.base.lanes import LANES, add, load, multiply_add, total, zeros

SOLVED = 0
NEGATIVE_CURVATURE = 1
EXHAUSTED = 2

MAX_ITERATIONS = 3000
"""Most iterations of conjugate gradients for a solution or an equilibrium."""
MIN_NORM = 1e-14
"""Smallest norm of a unit vector, less its parts along others, that is
not round-off."""

Mask = NDArray[np.bool_]


class Transform(NamedTuple):
    """Read-only shapes and axes for the transform on an interface, shared by threads."""

    shape: tuple[int, int]  # of a profile; (1, nodes) on a line, so that a kernel serves both
    half: tuple[int, int]  # of its real transform
    all_axes: NDArray[np.int64]  # axes of the transform, counted on flat arrays for a line
    first_axes: NDArray[np.int64]  # all axes but the last
    last_axis: NDArray[np.int64]


def make_transform(shape: tuple[int, ...]) -> Transform:
    """Return the transform for profiles with a given shape.

    >>> line, plane = make_transform((8,)), make_transform((4, 6))
    >>> line[:2], [axes.tolist() for axes in line[2:]]
    (((1, 8), (1, 5)), [[0], [], [0]])
    >>> plane[:2], [axes.tolist() for axes in plane[2:]]
    (((4, 6), (4, 4)), [[0, 1], [0], [1]])
    """
    rows, columns = shape if len(shape) == 2 else (1, *shape)
    axes = np.arange(len(shape))
    return Transform((rows, columns), (rows, columns // 2 + 1), axes, axes[:-1], axes[-1:])


@jit_inside
def forward(transform: Transform, field: Array, spectrum: Array) -> None:
    """Write the unscaled transform of a field to `spectrum`. Both are flat."""
    if transform.first_axes.size == 0:  # a single row is a fifth slower than a flat array
        r2c(field, spectrum, transform.all_axes, True, 1.0, 1)
    else:
        modes = spectrum.reshape(transform.half)
        r2c(field.reshape(transform.shape), modes, transform.all_axes, True, 1.0, 1)


@jit_inside
def backward(transform: Transform, spectrum: Array, field: Array) -> None:
    """Write the inverse transform of a spectrum to `field`.

    The spectrum is overwritten.
    """
    if transform.first_axes.size == 0:
        c2r(spectrum, field, transform.last_axis, False, 1.0 / field.size, 1)
    else:
        modes = spectrum.reshape(transform.half)
        c2c(modes, modes, transform.first_axes, False, 1.0, 1)
        rows = field.reshape(transform.shape)
        c2r(modes, rows, transform.last_axis, False, 1.0 / field.size, 1)


@jit_inside
def convolve(
    transform: Transform, multiplier: Array, field: Array, spectrum: Array, out: Array
) -> None:
    """Multiply the Fourier modes of a field and write it to `out`.

    `spectrum` is a workspace.
    """
    forward(transform, field, spectrum)
    for i in range(spectrum.size):
        spectrum[i] *= multiplier[i]
    backward(transform, spectrum, out)


class Operator(NamedTuple):
    """K - W on an interface, with workspaces for solvers.

    Only one thread may use it at a time.
    """

    transform: Transform
    symbol: Array  # (modes,): K(k), Pa/m
    inverse: Array  # (modes,): 1/(K(k) + W/2) with the mean W
    weakening_rate: Array  # (nodes,): W, Pa/m, zero at residual nodes
    spectrum: NDArray[np.complex128]  # (modes,): overwritten by each transform
    residual: Array  # (nodes,): overwritten by `held_equilibrium.equilibrate`
    z: Array  # (nodes,): overwritten by conjugate gradients, like the next two
    direction: Array  # last direction; of negative curvature, if the solver returns it
    image: Array  # A times the direction
    soft_mode: Array  # (nodes,): y with y'Ay about 1 that `inverse` lacks, or empty
    spring: float  # stiffness of a spring that holds a patch, Pa/m; 0 without a spring
    phi: Array  # (nodes,): patch that the spring holds, of unit norm


def make_operator(symbol: Array, W: Array | float, shape: tuple[int, ...]) -> Operator:
    """Return the operator for a symbol and a weakening rate (Pa/m), a number or an array.

    The preconditioner adds half the mean rate of the nodes that weaken, or half the
    largest K(k) if no node does.

    >>> symbol = np.array([0.0, 3.0, 6.0])
    >>> W = np.array([2.0, 0.0, 0.0, 6.0])
    >>> (1.0 / make_operator(symbol, W, (4,)).inverse).round(9).tolist()
    [2.0, 5.0, 8.0]
    >>> (1.0 / make_operator(symbol, 0.0, (4,)).inverse).round(9).tolist()
    [3.0, 6.0, 9.0]
    >>> make_operator(symbol, 2, (4,)).weakening_rate.tolist()
    [2.0, 2.0, 2.0, 2.0]
    """
    W = np.broadcast_to(np.asarray(W, dtype=np.float64), shape).flatten()
    typical = float(W[W > 0.0].mean()) if (W > 0.0).any() else float(symbol.max())
    # The preconditioner stays positive even where K - W is not.
    flat = symbol.flatten()
    spectrum, no_field = np.empty(flat.size, dtype=np.complex128), np.empty(0)
    residual, z, direction, image = np.empty((4, W.size))
    return Operator(
        make_transform(shape), flat, 1.0 / (flat + 0.5 * typical), W, spectrum, residual, z,
        direction, image, soft_mode=no_field, spring=0.0, phi=no_field,
    )  # fmt: skip


@jit
def filtered(operator: Operator, multiplier: Array, field: Array, out: Array) -> None:
    """Write a field with its Fourier modes multiplied to `out`.

    >>> operator = make_operator(np.array([0.0, 3.0, 6.0]), 1.0, (4,))
    >>> field, out = np.array([1.0, 4.0, 2.0, 9.0]), np.empty(4)
    >>> filtered(operator, np.array([0.0, 1.0, 5.0]), field, out)
    >>> np.allclose(out, np.fft.irfft([0.0, 1.0, 5.0] * np.fft.rfft(field), 4))
    True
    """
    convolve(operator.transform, multiplier, field, operator.spectrum, out)


@jit
def product(operator: Operator, field: Array, out: Array) -> None:
    """Write (K - W) field at every node, without a spring, to `out`.

    On a line, compared with the dense matrix, and on a plane with numpy:

    >>> symbol, W = np.array([0.0, 3.0, 6.0]), np.array([1.0, 2.0, 0.0, 5.0])
    >>> field, out = np.array([1.0, 4.0, 2.0, 9.0]), np.empty(4)
    >>> product(make_operator(symbol, W, (4,)), field, out)
    >>> column = np.fft.irfft(symbol, 4)
    >>> K = column[np.abs(np.subtract.outer(np.arange(4), np.arange(4)))]
    >>> np.allclose(out, K @ field - W * field)
    True
    >>> rng = np.random.default_rng(0)
    >>> symbol, field, out = rng.random((4, 4)), rng.random((4, 6)), np.empty(24)
    >>> symbol = np.fft.rfft2(np.fft.irfft2(symbol, (4, 6))).real
    >>> product(make_operator(symbol, 0.5, (4, 6)), field.ravel(), out)
    >>> exact = np.fft.irfft2(symbol * np.fft.rfft2(field), (4, 6)) - 0.5 * field
    >>> np.allclose(out, exact.ravel())
    True
    """
    filtered(operator, operator.symbol, field, out)
    W = operator.weakening_rate
    for i in range(out.size):
        out[i] -= W[i] * field[i]


@jit
def dot(first: Array, second: Array, count: int) -> float:
    """Return the inner product of the first `count` entries, in a single thread.

    A sum by numpy depends on its number of threads.

    >>> a, b = np.arange(1.0, 41.0), np.arange(40.0) % 7.0 - 2.0
    >>> [dot(a, b, count) == float(a[:count] @ b[:count]) for count in (0, 3, 4, 13, 29, 37, 40)]
    [True, True, True, True, True, True, True]
    """
    a = b = c = d = zeros()
    t = 0
    while t + 4 * LANES <= count:
        a = multiply_add(load(first, t), load(second, t), a)
        b = multiply_add(load(first, t + LANES), load(second, t + LANES), b)
        c = multiply_add(load(first, t + 2 * LANES), load(second, t + 2 * LANES), c)
        d = multiply_add(load(first, t + 3 * LANES), load(second, t + 3 * LANES), d)
        t += 4 * LANES
    if t + 2 * LANES <= count:
        a = multiply_add(load(first, t), load(second, t), a)
        b = multiply_add(load(first, t + LANES), load(second, t + LANES), b)
        t += 2 * LANES
    if t + LANES <= count:
        c = multiply_add(load(first, t), load(second, t), c)
        t += LANES
    remainder = 0.0
    while t < count:
        remainder = multiply_add(first[t], second[t], remainder)
        t += 1
    return total(add(add(a, b), add(c, d))) + remainder


@jit
def inner(a: Array, b: Array) -> float:
    """Return the inner product of two fields over all nodes.

    >>> inner(np.array([1.0, 2.0, 5.0]), np.array([4.0, 3.0, 1.0]))
    15.0
    """
    return dot(a, b, a.size)


@jit
def add_scaled(target: Array, factor: float, source: Array) -> None:
    """Add factor * source to `target`.

    >>> target = np.array([1.0, 2.0])
    >>> add_scaled(target, 3.0, np.array([5.0, -1.0]))
    >>> target.tolist()
    [16.0, -1.0]
    """
    for i in range(target.size):
        target[i] += factor * source[i]


@jit
def set_scaled(target: Array, factor: float, source: Array) -> None:
    """Set `target` to factor * source.

    (Numba takes seconds to compile a slice on the left.)

    >>> target = np.array([1.0, 2.0])
    >>> set_scaled(target, 3.0, np.array([5.0, -1.0]))
    >>> target.tolist()
    [15.0, -3.0]
    """
    for i in range(target.size):
        target[i] = factor * source[i]


@jit
def restrict(field: Array, inside: Mask) -> None:
    """Set a field to zero outside a set of nodes.

    >>> field = np.array([3.0, 4.0, 5.0])
    >>> restrict(field, np.array([True, False, True]))
    >>> field.tolist()
    [3.0, 0.0, 5.0]
    """
    for i in range(field.size):
        if not inside[i]:
            field[i] = 0.0


@jit
def largest_inside(field: Array, inside: Mask) -> float:
    """Return the largest absolute value on some nodes.

    >>> largest_inside(np.array([3.0, -4.0, 5.0]), np.array([True, True, False]))
    4.0
    """
    largest = 0.0
    for i in range(field.size):
        if inside[i]:
            largest = max(largest, abs(field[i]))
    return largest


@jit
def residual_of(operator: Operator, right: Array, x: Array, out: Array) -> None:
    """Write right - (A + spring phi phi') x at every node to `out`.

    The dense matrix with and without a spring of 7 Pa/m:

    >>> operator = make_operator(np.array([0.0, 3.0, 6.0]), 0.5, (4,))
    >>> column = np.fft.irfft([0.0, 3.0, 6.0], 4)
    >>> A = column[np.abs(np.subtract.outer(np.arange(4), np.arange(4)))] - 0.5 * np.eye(4)
    >>> phi, right = np.array([0.6, 0.8, 0.0, 0.0]), np.array([1.0, 5.0, 2.0, -3.0])
    >>> x, out = np.array([2.0, -1.0, 4.0, 1.0]), np.empty(4)
    >>> residual_of(operator, right, x, out)
    >>> np.allclose(out, right - A @ x)
    True
    >>> residual_of(operator._replace(spring=7.0, phi=phi), right, x, out)
    >>> np.allclose(out, right - (A + 7.0 * np.outer(phi, phi)) @ x)
    True
    """
    product(operator, x, out)
    for i in range(out.size):
        out[i] = right[i] - out[i]
    if operator.spring > 0.0:
        add_scaled(out, -operator.spring * inner(operator.phi, x), operator.phi)


@jit
def solve_inside(
    operator: Operator, inside: Mask, x: Array, residual: Array, tolerance: float
) -> tuple[int, int]:
    """Solve (1) by conjugate gradients.

    On entry x is a guess, and on return the solution. `residual` is the
    residual of x, as in `residual_of`. Both are zero outside the set.
    Returns SOLVED (no residual above the tolerance, Pa),
    NEGATIVE_CURVATURE (along `operator.direction`) or EXHAUSTED, and
    the number of iterations.

    Three of four nodes are solved for, from a guess, without and with a spring:

    >>> operator = make_operator(np.array([0.0, 3.0, 6.0]), 0.5, (4,))
    >>> column = np.fft.irfft([0.0, 3.0, 6.0], 4)
    >>> A = column[np.abs(np.subtract.outer(np.arange(4), np.arange(4)))] - 0.5 * np.eye(4)
    >>> inside, right = np.array([True, True, False, True]), np.array([1.0, 5.0, 2.0, -3.0])
    >>> phi, S = np.array([0.6, 0.8, 0.0, 0.0]), np.ix_(inside, inside)
    >>> for spring in 0.0, 7.0:
    ...     held = operator._replace(spring=spring, phi=phi)
    ...     x, residual = np.array([2.0, 1.0, 0.0, 0.0]), np.empty(4)
    ...     residual_of(held, right, x, residual)
    ...     status, iterations = solve_inside(held, inside, x, residual, 1e-10)
    ...     exact = np.linalg.solve((A + spring * np.outer(phi, phi))[S], right[inside])
    ...     print(status == SOLVED, iterations <= 6, np.allclose(x[inside], exact), float(x[2]))
    True True True 0.0
    True True True 0.0

    With W = 3 Pa/m, a direction of negative curvature ends the search:

    >>> operator, x = make_operator(np.array([0.0, 3.0, 6.0]), 3.0, (4,)), np.zeros(4)
    >>> status, iterations = solve_inside(operator, inside, x, right.copy(), 1e-10)
    >>> direction = operator.direction
    >>> curvature = direction @ (A - 2.5 * np.eye(4)) @ direction
    >>> status == NEGATIVE_CURVATURE, bool(curvature < 0.0), float(direction[2])
    (True, True, 0.0)
    """
    z, direction, image = operator.z, operator.direction, operator.image
    restrict(residual, inside)
    soft_mode = operator.soft_mode
    largest = largest_inside(residual, inside)
    r_z_before = 0.0
    for iteration in range(MAX_ITERATIONS):
        if largest <= tolerance:
            return SOLVED, iteration
        # 1.
        filtered(operator, operator.inverse, residual, z)
        if soft_mode.size > 0:
            add_scaled(z, inner(soft_mode, residual), soft_mode)
        # 2.
        r_z = inner(residual, z)
        beta = r_z / r_z_before if r_z_before > 0.0 else 0.0
        r_z_before = r_z
        for i in range(direction.size):
            # The first direction is z alone,
            # whatever a former solution left there.
            former = beta * direction[i] if beta > 0.0 else 0.0
            direction[i] = z[i] + former if inside[i] else 0.0
        product(operator, direction, image)
        if operator.spring > 0.0:
            add_scaled(image, operator.spring * inner(operator.phi, direction), operator.phi)
        # 3.
        curvature = inner(direction, image)
        if curvature <= 0.0:
            return NEGATIVE_CURVATURE, iteration + 1
        # 4.
        alpha = r_z / curvature
        largest = 0.0
        for i in range(direction.size):
            if inside[i]:
                x[i] += alpha * direction[i]
                residual[i] -= alpha * image[i]
                largest = max(largest, abs(residual[i]))
    return EXHAUSTED, MAX_ITERATIONS


@jit
def _combine(basis: Array, weights: Array, count: int, out: Array) -> None:
    """Step 3: combine the vectors of a basis into the next x and the next direction.

    basis[0] becomes the combination of all vectors. basis[2] and `out`
    become the combination without the first vector.

    >>> basis = np.array([[1.0, 2.0], [10.0, 20.0], [100.0, 300.0]])
    >>> out = np.empty(2)
    >>> _combine(basis, np.array([2.0, 3.0, 0.5]), 3, out)
    >>> out.tolist(), basis.tolist()
    ([80.0, 210.0], [[82.0, 214.0], [10.0, 20.0], [80.0, 210.0]])
    >>> _combine(basis, np.array([1.0, 2.0, 9.0]), 2, out)
    >>> out.tolist(), basis[0].tolist()
    ([20.0, 40.0], [102.0, 254.0])
    """
    for i in range(out.size):
        total = 0.0
        for k in range(1, count):
            total += weights[k] * basis[k, i]
        out[i] = basis[2, i] = total
        basis[0, i] = basis[0, i] * weights[0] + total


@jit_allocating
def lowest_eigenvector(
    operator: Operator, inside: Mask, vector: Array, tolerance: float, iterations: int
) -> float:
    """Solve (2): return the smallest eigenvalue of A on the nodes `inside`, Pa/m.

    On entry the vector is a guess. On return it is the eigenvector,
    with unit norm and positive sum, and is zero outside the set. The
    search stops when the norm of A y - lambda y is below the tolerance.

    >>> W = np.array([1.0, 2.0, 0.0, 5.0, 1.0, 1.0])
    >>> operator = make_operator(np.array([0.0, 3.0, 6.0, 9.0]), W, (6,))
    >>> column = np.fft.irfft([0.0, 3.0, 6.0, 9.0], 6)
    >>> A = column[np.abs(np.subtract.outer(np.arange(6), np.arange(6)))]
    >>> A -= np.diag(W)
    >>> inside, vector = np.arange(6) != 4, np.full(6, -1e-200)
    >>> value = lowest_eigenvector(operator, inside, vector, 1e-10, 100)
    >>> values, vectors = np.linalg.eigh(A[np.ix_(inside, inside)])
    >>> abs(value - float(values[0])) < 1e-9
    True
    >>> np.allclose(vector[inside], np.abs(vectors[:, 0]))
    True
    >>> bool(vector[4] == 0.0 < vector.sum())
    True
    """
    nodes = vector.size
    basis = np.empty((3, nodes))  # x, the preconditioned residual, the last direction
    images, work = np.empty((3, nodes)), np.empty(nodes)  # A times these
    # The norm of a small guess may underflow. Scaling by a power of two
    # does not change its digits.
    exponent = math.frexp(largest_inside(vector, inside))[1]
    set_scaled(basis[0], math.ldexp(1.0, min(-exponent, 1000)), vector)
    restrict(basis[0], inside)
    set_scaled(basis[0], 1.0 / np.sqrt(inner(basis[0], basis[0])), basis[0])
    product(operator, basis[0], images[0])
    restrict(images[0], inside)
    value = inner(basis[0], images[0])
    count = 2
    for _ in range(iterations):
        # 1.
        set_scaled(work, 1.0, images[0])
        add_scaled(work, -value, basis[0])
        if np.sqrt(inner(work, work)) <= tolerance:
            break
        # 2.
        filtered(operator, operator.inverse, work, basis[1])
        restrict(basis[1], inside)
        product(operator, basis[1], images[1])
        restrict(images[1], inside)
        for k in range(1, count):
            for _ in range(2):  # twice, against round-off
                for m in range(k):
                    overlap = inner(basis[k], basis[m])
                    add_scaled(basis[k], -overlap, basis[m])
                    add_scaled(images[k], -overlap, images[m])
            norm = np.sqrt(inner(basis[k], basis[k]))
            if norm < MIN_NORM:
                count = k
                break
            set_scaled(basis[k], 1.0 / norm, basis[k])
            set_scaled(images[k], 1.0 / norm, images[k])
        # The residual lies in the space already: round-off is reached.
        if count < 2:
            break
        # 3.
        small = np.empty((count, count))
        for k in range(count):
            for m in range(k + 1):
                twice = inner(basis[k], images[m]) + inner(basis[m], images[k])
                small[k, m] = small[m, k] = 0.5 * twice
        values, vectors = np.linalg.eigh(small)
        value, weights = values[0], vectors[:, 0]
        _combine(basis, weights, count, work)
        _combine(images, weights, count, work)
        scale = 1.0 / np.sqrt(inner(basis[2], basis[2]))
        set_scaled(basis[2], scale, basis[2])
        set_scaled(images[2], scale, images[2])
        count = 3  # from now on there is a last direction
    total = 0.0
    for i in range(nodes):
        total += basis[0, i]
    set_scaled(vector, -1.0 if total < 0.0 else 1.0, basis[0])
    return value
