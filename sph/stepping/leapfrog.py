"""Kick-drift-kick leapfrog with one evaluation of the rates per step (Verlet form for velocity-dependent forces).

    y_{n+1/2} = y_n + dt/2 f_n;   x_{n+1} = x_n + dt v_{n+1/2};   y* = y_n + dt f_n;   f_{n+1} = f(x_{n+1}, y*);
    y_{n+1} = y_{n+1/2} + dt/2 f_{n+1}

for y = (v, rho, u, D^(1/3)): second order. With the conjugate force and energy sums the error of the total energy per
unit mass and step is dt^2/8 (|a_n|^2 - |a_{n+1}|^2), which telescopes, and because u takes the work of the predicted
velocities dt^2/4 ((a_n - a_{n-1}).a_n + (a_{n+1} - a_n).a_{n+1}), which in disordered matter at rest adds up as heat:
2e-4 of the projectile's energy in 5 ms of sand under 500 g (docs/results/time_step). The stress yields in the
evaluation of y* (radial return R) and stays there:

    S_{n+1} = R(S*) + dt/2 (f_{n+1} - f_n)

``sph.stepping.integrator`` evaluates between the two halves.
"""

from matter.compilation.jit import inner_kernel, parallel_kernel, prange

# particles that a thread takes at a time: numba drops what a parallel loop itself writes to arrays inside a tuple, not
# what it calls
_BLOCK = 1024


@inner_kernel
def _open_some(first, end, dt, cloud, rates, evaluated, freeze_energy):
    """``open_step`` for the particles ``first`` to ``end`` - 1."""
    x, v, rho, u, S = cloud.position, cloud.velocity, cloud.density, cloud.specific_energy, cloud.stress
    D, g = cloud.root_damage, cloud.gravity
    a, drho, du, dS, dD = rates.acceleration, rates.density, rates.energy, rates.stress, evaluated.damage_rate
    cap = evaluated.damage_cap
    hv, hrho, hu, half = cloud.half_velocity, cloud.half_density, cloud.half_energy, cloud.half_change
    hD = cloud.half_damage
    for i in range(first, end):
        for c in range(3):
            acceleration = a[i, c] + g[i, c]
            hv[i, c] = v[i, c] + 0.5 * dt * acceleration
            x[i, c] += dt * hv[i, c]
            v[i, c] += dt * acceleration
        hrho[i] = rho[i] + 0.5 * dt * drho[i]
        rho[i] += dt * drho[i]
        hu[i], hD[i] = u[i], D[i]
        if not freeze_energy:
            hu[i] = u[i] + 0.5 * dt * du[i]
            u[i] += dt * du[i]
            hD[i] = max(D[i], min(D[i] + 0.5 * dt * dD[i], cap[i]))
            D[i] = max(D[i], min(D[i] + dt * dD[i], cap[i]))
        for c in range(5):
            half[i, c] = 0.5 * dt * dS[i, c]
            S[i, c] += dt * dS[i, c]


@inner_kernel
def _close_some(first, end, dt, cloud, rates, evaluated, floor, freeze_energy, velocity_factor):
    """``close_step`` for the particles ``first`` to ``end`` - 1."""
    v, rho, u, S, D = cloud.velocity, cloud.density, cloud.specific_energy, cloud.stress, cloud.root_damage
    g = cloud.gravity
    a, drho, du, dS, dD = rates.acceleration, rates.density, rates.energy, rates.stress, evaluated.damage_rate
    cap = evaluated.damage_cap
    hv, hrho, hu, half = cloud.half_velocity, cloud.half_density, cloud.half_energy, cloud.half_change
    hD = cloud.half_damage
    P, peak, material = evaluated.pressure, cloud.peak_pressure, cloud.material
    for i in range(first, end):
        for c in range(3):
            v[i, c] = velocity_factor * (hv[i, c] + 0.5 * dt * (a[i, c] + g[i, c]))
        rho[i] = max(hrho[i] + 0.5 * dt * drho[i], floor[material[i]])
        if not freeze_energy:
            u[i] = hu[i] + 0.5 * dt * du[i]
            D[i] = max(hD[i], min(hD[i] + 0.5 * dt * dD[i], cap[i]))
            peak[i] = max(peak[i], P[i])
        for c in range(5):
            # S has yielded since: what the evaluation returned to the surface stays there
            S[i, c] += 0.5 * dt * dS[i, c] - half[i, c]


@parallel_kernel
def open_step(dt, cloud, rates, evaluated, freeze_energy):
    """The first half of a step, of ``sph.bodies.particle_cloud.Fields`` in place, with ``sph.pairs.rate_arrays.Sums``
    and ``sph.stepping.state.Response``: half a kick, drift, prediction."""
    n = len(cloud.mass)
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        _open_some(block * _BLOCK, min(n, (block + 1) * _BLOCK), dt, cloud, rates, evaluated, freeze_energy)


@parallel_kernel
def close_step(dt, cloud, rates, evaluated, floor, freeze_energy, velocity_factor):
    """The second half of a step, as ``open_step``; ``floor`` (m,) is the least density of each material [kg/m^3],
    ``velocity_factor`` damps velocities; with ``freeze_energy`` u and D stay."""
    n = len(cloud.mass)
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        _close_some(
            block * _BLOCK,
            min(n, (block + 1) * _BLOCK),
            dt,
            cloud,
            rates,
            evaluated,
            floor,
            freeze_energy,
            velocity_factor,
        )
