"""What a multibody engine makes of a small foot that falls on the ground: MuJoCo beside Tarsus and the closed form.

    pip install mujoco
    python benchmarks/multibody.py

A foot falls freely by the gap of the micro-cantilever and bounces: its rebound is restitution times the speed of its
impact. MuJoCo's contacts are springs with damping (`solref`), so its restitution is whatever the damping makes of it,
and a foot sinks in by as much as the spring gives way.
"""

from __future__ import annotations

import math
import time

GRAVITY = 9.81
GAP = 70e-6
"""Of the cantilever's tip [m]."""

LENGTH, MASS = 1e-3, 1e-9
"""Units of the scaled model: millimetres and micrograms, seconds stay; stated in metres and kilograms."""


def foot(mass: float, radius: float, gap: float, gravity: float, solref: tuple[float, float], step: float):
    """MuJoCo's model of a foot above a plane, free to move upward only."""
    import mujoco

    contact = f'solref="-{solref[0]:.17g} -{solref[1]:.17g}"'
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 -{gravity}"/><worldbody>'
        f'<geom type="plane" size="1 1 1" {contact}/><body pos="0 0 {radius + gap}"><joint type="slide" axis="0 0 1"/>'
        f'<geom type="sphere" size="{radius}" mass="{mass}" {contact}/></body></worldbody></mujoco>'
    )


def fall(stiffness: float, damping: float, step: float) -> tuple[float, float, float]:
    """Restitution, largest depth below the ground [m], and seconds of processor time, in scaled units.

    stiffness [1/s^2], damping [1/s]: of the contact, per unit of mass; step [s].
    """
    import mujoco

    gap = GAP / LENGTH
    model = foot(1e-9 / MASS, 0.1, gap, GRAVITY / LENGTH, (stiffness, damping), step)
    data = mujoco.MjData(model)
    start = time.process_time()
    fastest = deepest = up = 0.0
    for _ in range(int(1.6 * math.sqrt(2.0 * GAP / GRAVITY) / step)):
        mujoco.mj_step(model, data)
        z, v = data.qpos[0] + gap, data.qvel[0]
        fastest, deepest = min(fastest, v), min(deepest, z)
        if fastest < 0.0 < v:
            up = max(up, v)
    return up / -fastest, -deepest * LENGTH, time.process_time() - start


def exact() -> tuple[float, float, float]:
    """The same by Tarsus, restitution 0.378."""
    import tarsus as ts

    scene = ts.Scene(
        name="foot",
        duration=1.6 * math.sqrt(2.0 * GAP / GRAVITY),
        robot=ts.Robot(
            structure=ts.Lumped(coordinates=("foot",), mass=((1e-9,),), stiffness=((0.0,),)),
            drives={},
            feet={"foot": ts.Foot(point="foot", gap=GAP)},
        ),
        ground=ts.Ground(restitution=ts.Restitution(coefficient=0.378), gravity=ts.Gravity()),
        signals={},
    )
    session = ts.Session(scene)
    session.run()
    start = time.process_time()
    run = session.run()
    first = run.events[0]
    return float(first["speed_after"] / first["speed_before"]), 0.0, time.process_time() - start


def main() -> None:
    try:
        foot(1e-9, 1e-4, GAP, GRAVITY, (1e4, 10.0), 1e-6)
    except ValueError as error:
        print("1 ug in SI units:", " ".join(str(error).split()))
    print("contact                      step [us]  restitution  depth [nm]   CPU [ms]")
    for stiffness, step in ((1e8, 1e-6), (1e10, 1e-6), (1e10, 1e-7), (1e12, 1e-7), (1e12, 1e-8)):
        # of a damped spring: ratio of speeds after half a period, e = exp(-pi zeta / sqrt(1 - zeta^2))
        log = math.log(0.378)
        zeta = -log / math.hypot(math.pi, log)
        found = fall(stiffness, 2.0 * zeta * math.sqrt(stiffness), step)
        print(
            f"MuJoCo, {stiffness:.0e} /s^2, for 0.378  {1e6 * step:7g}  {found[0]:11.4f}  {1e9 * found[1]:10.3g}"
            f"  {1e3 * found[2]:9.3g}"
        )
    found = exact()
    print(f"Tarsus, 0.378                {'':9}  {found[0]:11.4f}  {found[1]:10.3g}  {1e3 * found[2]:9.3g}")


if __name__ == "__main__":
    main()
