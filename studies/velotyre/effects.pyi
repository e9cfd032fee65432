# Written by python -m studies.door.door_stubs from the table of names and the declarations of the effects.

from bicycle.effects.effect import Effect, PerWheel, PerWheelValue

class AerodynamicDrag(Effect):
    """Drag D = density drag_area v^2 / 2 at a point of the rear frame, and the equal drive force at the rear contact.

    Drag follows the relative wind: if the point moves to the right by s and the air by ``side_wind``, an input (m/s),
    the wind comes at the yaw angle beta = (side_wind - s) / v. With p = density v^2 / 2 the air pushes to the right by
    p (drag_area + side_area) beta and turns to the right by p yaw_moment_area beta. A side offset of the point gives
    the yaw moment D offset, the pitching moment shifts D |z| / w of vertical load from the front wheel to the rear. The
    front wheel lifts where that exceeds its load; the linear model does not know. Usual areas are those of riders
    without a fairing, from a racer's crouch to an upright commuter.

    Parameters
    ----------
    drag_area : float, m^2, default 0.4
        Drag coefficient times frontal area; typical 0.3 .. 0.6, allowed 0 .. inf; the effect vanishes at 0;
        negligible below 0.02.
    centre_of_pressure_z : float, m
        Height of the drag on the rear frame, z down; typical -1.3 .. -0.9, allowed -inf .. 0.
    centre_of_pressure_x : float, m, default xB of the bicycle
        Place of the side force on the rear frame; typical 0.2 .. 0.7, allowed any.
    air_density : float, kg/m^3, default 1.225
        1.225 at 15 °C and sea level; typical 1 .. 1.3, allowed 0 .. inf; the effect vanishes at 0; negligible below
        0.06.
    side_area : float, m^2/rad, default 0
        Slope over the yaw angle of the force across the wind, over the dynamic pressure; typical 0 .. 1.5, allowed
        any; the effect vanishes at 0.
    yaw_moment_area : float, m^3/rad, default 0
        Slope over the yaw angle of the moment about the centre of pressure, over the dynamic pressure; typical -0.5
        .. 0.5, allowed any; the effect vanishes at 0.

    Notes
    -----
    Source: Sharp (2001), Vehicle System Dynamics 35; Debraux et al. (2011), Sports Biomechanics 10 (areas); Schwab,
    Dialynas & Happee (2018), Proceedings 2(6), 218 (side wind).
    """

    drag_area: float
    centre_of_pressure_z: float
    centre_of_pressure_x: float
    air_density: float
    side_area: float
    yaw_moment_area: float
    def __init__(
        self,
        *,
        centre_of_pressure_z: float,
        drag_area: float = 0.4,
        centre_of_pressure_x: float = ...,
        air_density: float = 1.225,
        side_area: float = 0.0,
        yaw_moment_area: float = 0.0,
    ) -> None: ...

class AligningMoment(Effect):
    """Lagged moment of the slip angle on each wheel, dMz/dt = (C_M/length) s - (v/length) Mz, steady Mz = -C_M alpha.

    The lateral force and its moment need not build up over the same distance. With C_M = t C, equal lengths and no
    camber thrust it is the pneumatic trail t.

    Parameters
    ----------
    aligning_stiffness : float or {rear, front}, N m/rad
        Moment against the slip, per slip angle; typical 50 .. 220, allowed 0 .. inf; the effect vanishes at 0;
        negligible below 5.
    relaxation_length : float or {rear, front}, m
        Travelled distance in which 63 % of the moment builds up; typical 0.05 .. 0.25, allowed 1e-06 .. inf.

    Notes
    -----
    Source: Pacejka, Tire and Vehicle Dynamics, ch. 5 and 7.
    """

    aligning_stiffness: PerWheel
    relaxation_length: PerWheel
    def __init__(
        self,
        *,
        aligning_stiffness: PerWheelValue,
        relaxation_length: PerWheelValue,
    ) -> None: ...

class CamberThrust(Effect):
    """Lateral force C_gamma gamma towards the lean; ``lag_share`` of it builds up with the slip force, the rest at
    once.

    A tyre whose camber stiffness equals its load carries a steady lean without slipping. Some tyres show a
    non-lagging part.

    Parameters
    ----------
    camber_stiffness : float or {rear, front}, N/rad
        Lateral force per camber angle; typical 150 .. 700 (0.43 to 0.94 of loads of 350 to 745 N; from Dressel
        (2013) to a Schwalbe tyre), allowed 0 .. inf; the effect vanishes at 0; negligible below 20.
    lag_share : float, dimensionless, default 1
        Share of the camber force that lags with the slip force; typical 0 .. 1, allowed 0 .. 1.

    Notes
    -----
    Source: Pacejka, Tire and Vehicle Dynamics, ch. 7 and 11.
    """

    camber_stiffness: PerWheel
    lag_share: float
    def __init__(
        self,
        *,
        camber_stiffness: PerWheelValue,
        lag_share: float = 1.0,
    ) -> None: ...

class ContactLength(Effect):
    """Lateral force and moment of a string in contact from +a to -a, within the measured relaxation length L.

    Its free ends decay over sigma, c_c is the lateral stiffness per length. Measured are C = 2 c_c (sigma + a)^2 and,
    without rolling, K = 2 c_c (sigma + a), so L = C/K is sigma + a. A deflection straight along the contact,
    q0 + q1 x/a, gives F = K q0 and Mz = t C q1/a with the trail t = (L^3 - sigma^3) / (3 L^2). Over the travelled
    distance x, with the slip alpha = -s/v and the turn slip phi = -(yaw rate of the wheel)/v,

        dF/dx = K alpha + Mz / (t L),        dMz/dx = t C phi - (F - camber force) - Mz / t.

    Of two states only these have the string's stiffness at rest (K; in yaw t C) and its C, t and force t C of turn slip
    when rolling steadily; F/phi = -Mz/alpha and the lag L - t of the force on long waves are then the string's too, and
    a = 0 is the single lag. With a = 0.045 m, L = 0.11 m and a wavelength of 0.5 m F/alpha misses the exact string by
    1.6 % and 0.0 deg (the single lag by 20.5 %, 3.9 deg), Mz/alpha by 7 % and 1.3 deg: docs/physics.md. Waves shorter
    than the contact have no meaning. Camber force builds up like that of turn slip, at the contact centre.

    Parameters
    ----------
    half_length : float or {rear, front}, m, default 0.03
        Half the length of the contact, a; typical 0.02 .. 0.06, allowed 1e-06 .. inf.
    turn_slip_share : float, dimensionless, default 1
        Share of the turn slip that deforms the contact; typical 0 .. 1, allowed 0 .. 1.

    Notes
    -----
    Source: von Schlippe & Dietrich (1941); Pacejka, Tire and Vehicle Dynamics, ch. 5.
    """

    half_length: PerWheel
    turn_slip_share: float
    def __init__(
        self,
        *,
        half_length: PerWheelValue = 0.03,
        turn_slip_share: float = 1.0,
    ) -> None: ...

class CrownRadius(Effect):
    """A toroidal tyre of crown radius rho: the contact moves sideways by rho gamma, so the wheel centre sinks less.

    Height of the lowest point z = z_centre + (r - rho) cos(gamma) + rho, to second order in the potential; the side
    force still acts at the ground. Without a number the tyre is 25 mm wide and its cross-section a circle.

    Parameters
    ----------
    crown_radius : float or {rear, front}, m, default 0.0125
        Radius of the tyre's cross-section; typical 0.01 .. 0.03, allowed 0 .. inf; the effect vanishes at 0;
        negligible below 0.001.

    Notes
    -----
    Source: Sharp (1971), J. Mech. Eng. Sci. 13(5), 316-329; Cossalter, Motorcycle Dynamics, ch. 1.
    """

    crown_radius: PerWheel
    def __init__(
        self,
        *,
        crown_radius: PerWheelValue = 0.0125,
    ) -> None: ...

class ForkBending(Effect):
    """A sprung and damped hinge across the steer axis that carries the front wheel and turns with the handlebar.

    Axis (cos lam, 0, -sin lam) through the steer axis, ``length`` above the point of it next to the wheel centre. A
    lateral force F at the hub moves it by F length^2 / stiffness. With front_compliance, the twist of the frame, it
    is the second joint of the front frame.

    Parameters
    ----------
    stiffness : float, N m/rad, default 6000
        Of the hinge; typical 2000 .. 20000, allowed 0 .. inf; the effect vanishes at inf; negligible above 40000.
    damping : float, N m s/rad, default 5
        Of the hinge; typical 1 .. 30, allowed 0 .. inf.
    length : float, m, default 0.38
        From the wheel centre up to the hinge, along the steer axis; typical 0.2 .. 0.5, allowed -2 .. 2.

    Notes
    -----
    Source: Spierings (1981), Vehicle System Dynamics 10, 21-35; Plöchl, Edelmann, Angrosch & Ott (2012), Vehicle
    System Dynamics 50.
    """

    stiffness: float
    damping: float
    length: float
    def __init__(
        self,
        *,
        stiffness: float = 6000.0,
        damping: float = 5.0,
        length: float = 0.38,
    ) -> None: ...

class FrontCompliance(Effect):
    """A sprung and damped hinge between rear frame and steer axis that carries the whole front assembly.

    Axis (cos axis_tilt, 0, -sin axis_tilt) through (joint_x, 0, joint_z), by default perpendicular to the steer axis.
    ``damping_ratio``, of the front frame on its hinge with the rear frame held, may replace ``damping``.
    ``height_above_hub``, m along the steer axis from its point nearest to the front hub, may replace ``joint_x`` and
    ``joint_z``.

    Parameters
    ----------
    stiffness : float, N m/rad, default 5000
        Of the hinge; typical 1000 .. 10000, allowed 0 .. inf; the effect vanishes at inf; negligible above 20000.
    damping : float, N m s/rad, default 20
        Of the hinge; typical 5 .. 40 (assumed for frame and seated rider together, where the rider is fixed; agrees
        with riders' reports; 20 at 5000 N m/rad is a damping ratio of 0.12 to 0.24), allowed 0 .. inf.
    joint_x : float, m
        Hinge; or height_above_hub for both; typical 0.7 .. 1, allowed any.
    joint_z : float, m
        Hinge, z down; typical -1 .. -0.55 (by beam models racing frames tilt about a point 0.25 to 0.38 m above the
        front hub), allowed any.
    axis_tilt : float, rad, default lam of the bicycle
        Angle of the hinge axis above the horizontal, forward end up; typical 0 .. 0.5, allowed -3.14159 .. 3.14159.

    Notes
    -----
    Source: Sharp & Alstead (1980), Vehicle System Dynamics 9; Plöchl, Edelmann, Angrosch & Ott (2012), Vehicle
    System Dynamics 50.
    """

    stiffness: float
    damping: float
    joint_x: float
    joint_z: float
    axis_tilt: float
    def __init__(
        self,
        *,
        joint_x: float,
        joint_z: float,
        stiffness: float = 5000.0,
        damping: float = 20.0,
        axis_tilt: float = ...,
    ) -> None: ...

class HandlebarBag(Effect):
    """A point mass fixed to the steered front frame that the bicycle's parameters do not contain: bag, basket, lamp.

    It turns with the steering and with whatever carries the front frame; its own extent is neglected.

    Parameters
    ----------
    mass : float, kg
        Of the bag; typical 0.5 .. 5, allowed 0 .. inf; the effect vanishes at 0; negligible below 0.2.
    x : float, m, default 0.85
        Mass centre, ahead of the rear contact; typical 0.6 .. 1, allowed any.
    z : float, m, default -0.9
        Mass centre, z down; typical -1.1 .. -0.7, allowed any.

    Notes
    -----
    Source: Meijaard, Papadopoulos, Ruina & Schwab (2007), Proc. R. Soc. A 463, appendix B (a further rigid body).
    """

    mass: float
    x: float
    z: float
    def __init__(
        self,
        *,
        mass: float,
        x: float = 0.85,
        z: float = -0.9,
    ) -> None: ...

class Longitudinal(Effect):
    """Forces along the wheels at both contacts, and what resists them: inertia of all masses, or weight on a slope.

    The force X = drive_force - brake_force changes the speed by dv/dt = X / m - g sin(slope). The equations are exact
    at the moment of the speed (under no_slip the yaw rate of a steer angle grows with dv/dt as well); roots describe
    motion only where it changes faster than the speed. Where X = m g sin(slope) the gradient keeps the speed.
    Each mass m_i feels X m_i / m backwards, which with the spin-up of the wheels moves
    (X |z_m| + sum(Iyy / r) dv/dt) / w of load to the rear wheel. Forces are those of the road on the tyres: a wheel
    that rolls freely takes -(Iyy / r^2) dv/dt, so with a rear brake alone the front wheel pushes forward, front_share =
    (Iyy / r^2) dv/dt / brake_force < 0. Tyres that a model file names are taken at these loads, those given by numbers
    are as given. Left out are slip along the wheel, which takes cornering stiffness, and the turning of the fall line
    against the heading.

    Parameters
    ----------
    drive_force : float, N, default 0
        At the rear contact, in addition to that against drag; typical 0 .. 200, allowed 0 .. inf; the effect
        vanishes at 0; negligible below 10.
    brake_force : float, N, default 0
        Backwards at both contacts; typical 0 .. 300, allowed 0 .. inf; the effect vanishes at 0; negligible below
        10.
    front_share : float, dimensionless, default 0.7
        Of the brake force; a wheel that rolls freely is a little outside 0 to 1; typical -0.05 .. 1.05, allowed -1
        .. 2.
    gradient : float, dimensionless, default 0
        Rise of the road per length on the level, > 0 uphill; typical -0.2 .. 0.2, allowed any; the effect vanishes
        at 0; negligible below 0.02.

    Notes
    -----
    Source: Limebeer, Sharp & Evangelou (2001), Proc. IMechE C 215, 1095-1109 (acceleration, braking, inclines).
    """

    drive_force: float
    brake_force: float
    front_share: float
    gradient: float
    def __init__(
        self,
        *,
        drive_force: float = 0.0,
        brake_force: float = 0.0,
        front_share: float = 0.7,
        gradient: float = 0.0,
    ) -> None: ...

class Luggage(Effect):
    """A point mass fixed to the rear frame that the bicycle's parameters do not contain: bag, rack, battery, lock.

    It brings weight, inertia and wheel loads; its own extent is small against its distance from the wheels' contacts.
    Usual are 0.5 kg (a rack or a lock by itself) to 10 kg.

    Parameters
    ----------
    mass : float, kg
        Of the luggage; typical 0.5 .. 10, allowed 0 .. inf; the effect vanishes at 0; negligible below 0.2.
    x : float, m, default 0.05
        Mass centre, ahead of the rear contact; typical -0.1 .. 0.25, allowed any.
    z : float, m, default -0.8
        Mass centre, z down; typical -1 .. -0.6, allowed any.

    Notes
    -----
    Source: Meijaard, Papadopoulos, Ruina & Schwab (2007), Proc. R. Soc. A 463, appendix B (a further rigid body).
    """

    mass: float
    x: float
    z: float
    def __init__(
        self,
        *,
        mass: float,
        x: float = 0.05,
        z: float = -0.8,
    ) -> None: ...

class NoSlip(Effect):
    """Wheels that roll without side slip; the lateral force is whatever holds the contact (the Whipple bicycle).

    Notes
    -----
    Source: Meijaard, Papadopoulos, Ruina & Schwab (2007), Proc. R. Soc. A 463, doi 10.1098/rspa.2007.1857.
    """

    def __init__(self) -> None: ...

class OverturningMoment(Effect):
    """Moment Mx = -overturning_stiffness gamma - arm F about the forward axis of a leaning tyre with lateral force F.

    The load of a leaning tyre acts outside its plane, and a lateral force shifts the contact sideways under the load.
    Of a tyre of radius rho crown_radius does the first exactly; give here what is measured beyond it.

    Parameters
    ----------
    overturning_stiffness : float or {rear, front}, N m/rad, default 2
        Moment against the lean, per camber angle; typical -5 .. 10, allowed any; the effect vanishes at 0;
        negligible below 0.2.
    arm : float or {rear, front}, m, default 0
        Moment per lateral force: load over lateral stiffness; typical 0 .. 0.01, allowed any; the effect vanishes
        at 0.

    Notes
    -----
    Source: Pacejka, Tire and Vehicle Dynamics, ch. 4 (Mx) and 11; Sharp, Evangelou & Limebeer (2004).
    """

    overturning_stiffness: PerWheel
    arm: PerWheel
    def __init__(
        self,
        *,
        overturning_stiffness: PerWheelValue = 2.0,
        arm: PerWheelValue = 0.0,
    ) -> None: ...

class PneumaticTrail(Effect):
    """The lateral force acts behind the contact centre: Mz = -t F on both wheels, camber part included.

    Under no_slip F is the constraint force.

    Parameters
    ----------
    trail : float or {rear, front}, m, default 0.017
        Distance of the lateral force behind the contact centre; typical 0 .. 0.03, allowed 0 .. 0.2; the effect
        vanishes at 0; negligible below 0.001.

    Notes
    -----
    Source: Pacejka, Tire and Vehicle Dynamics, ch. 3.
    """

    trail: PerWheel
    def __init__(
        self,
        *,
        trail: PerWheelValue = 0.017,
    ) -> None: ...

class RearCompliance(Effect):
    """A sprung and damped hinge between main frame and rear wheel, which twists out of the plane of the frame.

    Axis (cos axis_tilt, 0, -sin axis_tilt) through (joint_x, 0, joint_z), by default level: the wheel leans.

    Parameters
    ----------
    stiffness : float, N m/rad, default 10000
        Of the hinge; typical 2000 .. 40000, allowed 0 .. inf; the effect vanishes at inf; negligible above 80000.
    damping : float, N m s/rad, default 10
        Of the hinge; typical 1 .. 50, allowed 0 .. inf.
    joint_x : float, m, default 0.42
        Hinge; typical 0.3 .. 0.6, allowed any.
    joint_z : float, m, default -0.3
        Hinge, z down; typical -0.5 .. -0.2, allowed any.
    axis_tilt : float, rad, default 0
        Angle of the hinge axis above the horizontal, forward end up; typical -0.5 .. 0.5, allowed -3.14159 ..
        3.14159.

    Notes
    -----
    Source: Sharp (1974), Vehicle System Dynamics 3, 123-141 (rear frame flexibility of motorcycles).
    """

    stiffness: float
    damping: float
    joint_x: float
    joint_z: float
    axis_tilt: float
    def __init__(
        self,
        *,
        stiffness: float = 10000.0,
        damping: float = 10.0,
        joint_x: float = 0.42,
        joint_z: float = -0.3,
        axis_tilt: float = 0.0,
    ) -> None: ...

class RelaxationLength(Effect):
    """First-order lateral force, (sigma/v) dF/dt + F = C_alpha alpha + camber force, regular at v = 0.

    Written as dF/dt = -(C_alpha/sigma) s - (v/sigma) (F - camber force): C_alpha/sigma is the lateral stiffness K_y of
    the standing tyre. A compliance 1/K_w in series (rim, spokes) lengthens sigma to C_alpha (1/K_y + 1/K_w).

    Parameters
    ----------
    cornering_stiffness : float or {rear, front}, N/rad
        Slope of the lateral force at zero slip; typical 2000 .. 12000, allowed 0 .. inf.
    relaxation_length : float or {rear, front}, m
        Travelled distance in which 63 % of the lateral force builds up; typical 0.05 .. 0.25, allowed 1e-06 .. inf.

    Notes
    -----
    Source: Dell'Orto, Ballo, Mastinu & Gobbi, eq. 1 and 3; Pacejka, Tire and Vehicle Dynamics, ch. 7.
    """

    cornering_stiffness: PerWheel
    relaxation_length: PerWheel
    def __init__(
        self,
        *,
        cornering_stiffness: PerWheelValue,
        relaxation_length: PerWheelValue,
    ) -> None: ...

class RiderArms(Effect):
    """Arms as a moment of inertia, a spring and a damper between the rear frame and the steering.

    The inertia moves with the steer angle only.

    Parameters
    ----------
    inertia : float, kg m^2, default 0.1
        Of the arms about the steer axis; typical 0.05 .. 0.2, allowed 0 .. inf; the effect vanishes at 0;
        negligible below 0.005.
    stiffness : float, N m/rad, default 5
        Of the arms against steering; typical 0 .. 30, allowed 0 .. inf; the effect vanishes at 0; negligible below
        0.1.
    damping : float, N m s/rad, default 1
        Of the arms against steering; typical 0.2 .. 3, allowed 0 .. inf; the effect vanishes at 0; negligible below
        0.02.

    Notes
    -----
    Source: Schwab, Meijaard & Kooijman (2012), Vehicle System Dynamics 50; Klinger et al. (2014), ibid. 52 (hands).
    """

    inertia: float
    stiffness: float
    damping: float
    def __init__(
        self,
        *,
        inertia: float = 0.1,
        stiffness: float = 5.0,
        damping: float = 1.0,
    ) -> None: ...

class RiderControl(Effect):
    """Steer torque T'' + 2 zeta omega T' + omega^2 T = omega^2 u of a rider, u = gains on roll, steer and their rates.

    A positive gain on roll steers to the side the bicycle leans to. The gains hold at the speed at which they were
    identified. rider_steer_memory or rider_path adds what holds the heading, rider_delay a time delay.

    Parameters
    ----------
    roll : float, N m/rad, default 0
        Torque per roll angle; typical 0 .. 80, allowed any; the effect vanishes at 0; negligible below 0.5.
    roll_rate : float, N m s/rad, default 0
        Torque per roll rate; typical 0 .. 40, allowed any; the effect vanishes at 0; negligible below 0.2.
    steer : float, N m/rad, default 0
        Torque per steer angle; typical -120 .. 20, allowed any; the effect vanishes at 0; negligible below 0.5.
    steer_rate : float, N m s/rad, default 0
        Torque per steer rate; typical -8 .. 1, allowed any; the effect vanishes at 0; negligible below 0.05.
    filter_frequency : float, rad/s, default 13.6345
        Natural frequency omega of the neuromuscular filter; typical 5 .. 40, allowed 0.1 .. inf.
    filter_damping : float, dimensionless, default 0.707107
        Damping ratio zeta of the neuromuscular filter; typical 0.3 .. 1.2, allowed 0 .. inf.

    Notes
    -----
    Source: Schwab, de Lange, Happee & Moore (2013), Multibody System Dynamics; Hess, Moore & Hubbard (2012), IEEE
    SMC A.
    """

    roll: float
    roll_rate: float
    steer: float
    steer_rate: float
    filter_frequency: float
    filter_damping: float
    def __init__(
        self,
        *,
        roll: float = 0.0,
        roll_rate: float = 0.0,
        steer: float = 0.0,
        steer_rate: float = 0.0,
        filter_frequency: float = 13.634512116579701,
        filter_damping: float = 0.7071067811865476,
    ) -> None: ...

class RiderDelay(Effect):
    """Delay of the command to the rider's muscles, as a Pade approximant of order 2.

    D(s) = (1 - s delay/2 + (s delay)^2/12) / (1 + s delay/2 + (s delay)^2/12): the phase is right to 1 degree up to
    s = 2.2j / delay. Margins of velotyre closed-loop take the delay exactly.

    Parameters
    ----------
    delay : float, s
        From motion to command; typical 0.03 .. 0.3, allowed 0.001 .. inf.

    Notes
    -----
    Source: Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems, ch. 5 (Pade approximant).
    """

    delay: float
    def __init__(
        self,
        *,
        delay: float,
    ) -> None: ...

class RiderHands(Effect):
    """Arms as the mass that is felt at both hands, turning about the steer axis between torso and handlebar.

    The mass is taken out of the rear frame, which must contain the arms; stretched ones feel heavier. Shoulders and
    elbows hold it to the torso with ``stiffness`` and ``damping``, the grips to the handlebar with ``grip_stiffness``
    and ``grip_damping``, all about the steer axis. The torso is part of the rear frame, also with rider_lean; bending
    of frame and fork does not move the arms but through the grips.

    Parameters
    ----------
    mass : float, kg, default 4.5
        Felt at both hands together; typical 1 .. 14, allowed 1e-06 .. inf.
    half_width : float, m, default 0.21
        Half the distance of the hands; typical 0.15 .. 0.4, allowed 0 .. inf.
    x : float, m, default 0.85
        Hands, ahead of the rear contact; typical 0.5 .. 1.1, allowed any.
    z : float, m, default -0.95
        Hands, z down; typical -1.2 .. -0.7, allowed -3 .. 0.
    stiffness : float, N m/rad, default 10
        Of shoulders and elbows; typical 0 .. 60, allowed 0 .. inf.
    damping : float, N m s/rad, default 1
        Of shoulders and elbows; typical 0.2 .. 4, allowed 0 .. inf.
    grip_stiffness : float, N m/rad, default 200
        Of both grips; typical 20 .. 600, allowed 0 .. inf.
    grip_damping : float, N m s/rad, default 1
        Of both grips; typical 0.1 .. 4, allowed 0 .. inf.

    Notes
    -----
    Source: Klinger, Nusime, Edelmann & Ploechl (2014), Vehicle System Dynamics 52 (hands on the bar); Sharp (1994).
    """

    mass: float
    half_width: float
    x: float
    z: float
    stiffness: float
    damping: float
    grip_stiffness: float
    grip_damping: float
    def __init__(
        self,
        *,
        mass: float = 4.5,
        half_width: float = 0.21,
        x: float = 0.85,
        z: float = -0.95,
        stiffness: float = 10.0,
        damping: float = 1.0,
        grip_stiffness: float = 200.0,
        grip_damping: float = 1.0,
    ) -> None: ...

class RiderLean(Effect):
    """A body taken out of the rear frame and put back on a sprung, damped hinge along x at height joint_z.

    The rear frame of the bicycle must contain the body; inertias are about the body's mass centre. With rider_saddle
    the body is a part of the seated rider: it is taken out of that one, and its hinge moves with the saddle's.

    Parameters
    ----------
    mass : float, kg
        Of the moving body; typical 20 .. 60, allowed 0 .. inf.
    x : float, m
        Mass centre; typical 0.2 .. 0.6, allowed any.
    z : float, m
        Mass centre, z down; typical -1.5 .. -1, allowed any.
    Ixx : float, kg m^2
        Moment of inertia; typical 0.5 .. 5, allowed 0 .. inf.
    Izz : float, kg m^2
        Checked; a hinge along x hides it; typical 0.3 .. 3, allowed 0 .. inf.
    Ixz : float, kg m^2, default 0
        Tensor entry; typical -0.3 .. 0.3, allowed any.
    joint_z : float, m
        Height of the hinge, z down; typical -1.1 .. -0.7, allowed any.
    stiffness : float, N m/rad, default 1500
        Of the hinge; typical 500 .. 3000, allowed 0 .. inf; the effect vanishes at inf; negligible above 20000.
    damping : float, N m s/rad, default 60
        Of the hinge; typical 10 .. 150, allowed 0 .. inf.

    Notes
    -----
    Source: Schwab, Meijaard & Kooijman (2012), Vehicle System Dynamics 50; Doria & Tognazzo (2014), IMechE C 228.
    """

    mass: float
    x: float
    z: float
    Ixx: float
    Izz: float
    Ixz: float
    joint_z: float
    stiffness: float
    damping: float
    def __init__(
        self,
        *,
        mass: float,
        x: float,
        z: float,
        Ixx: float,
        Izz: float,
        joint_z: float,
        Ixz: float = 0.0,
        stiffness: float = 1500.0,
        damping: float = 60.0,
    ) -> None: ...

class RiderPath(Effect):
    """Command heading * psi + position * y_front to the muscles of rider_control, both from a straight lane.

    psi is the heading of the rear frame (> 0 to the right), y_front the lateral place of the front contact.

    Parameters
    ----------
    heading : float, N m/rad
        Torque per heading angle; typical 0.5 .. 40, allowed any.
    position : float, N m/m
        Torque per lateral place of the front contact; typical 0.1 .. 3, allowed any.

    Notes
    -----
    Source: Hess, Moore & Hubbard (2012), Modeling the manually controlled bicycle, IEEE Transactions SMC A 42.
    """

    heading: float
    position: float
    def __init__(
        self,
        *,
        heading: float,
        position: float,
    ) -> None: ...

class RiderSaddle(Effect):
    """The seated rider, taken out of the rear frame and put back on a sprung, damped hinge along z at the saddle.

    The whole body turns, trunk and legs. By default it is a share of the rear frame, with its mass centre. A model file
    may name the same bicycle without rider instead, ``without_rider = "pista"``. ``damping_ratio``, of the body on its
    hinge with the frame held, may be given in place of ``damping``. Arms (rider_arms, rider_hands) still hold to the
    rear frame. rider_saddle_roll lets the body roll.

    Parameters
    ----------
    mass : float, kg, default mB of the bicycle
        Of the body; typical 50 .. 100, allowed 0 .. inf.
    mass_share : float, dimensionless, default 0.93
        Of mass that is the rider's; 1 where mass is given; typical 0.78 .. 0.98 (packaged bicycles with and without
        rider: 0.78 to 0.95), allowed 0.1 .. 1.
    x : float, m, default xB of the bicycle
        Mass centre; typical 0.3 .. 0.5, allowed any.
    z : float, m, default zB of the bicycle
        Mass centre, z down; typical -1.15 .. -0.95, allowed any.
    Ixx : float, kg m^2, default IBxx of the bicycle
        Of use with rider_saddle_roll; typical 6 .. 12, allowed 0 .. inf.
    Izz : float, kg m^2, default IBzz of the bicycle
        About the mass centre; typical 2 .. 4, allowed 0 .. inf.
    Ixz : float, kg m^2, default IBxz of the bicycle
        Tensor entry; typical -2 .. 2, allowed any.
    inertia_share : float, dimensionless, default 0.85
        Of Ixx, Izz and Ixz that is the rider's; 1 where one of them is given; typical 0.5 .. 1 (packaged bicycles
        with and without rider: 0.53 to 0.92), allowed 0.1 .. 1.
    joint_x : float, m, default 0.2
        Saddle, ahead of the rear contact; typical 0.1 .. 0.3 (hips of two riders on three measured bicycles: 0.17
        to 0.21), allowed any.
    stiffness : float, N m/rad, default 12000
        Of the hinge; typical 2000 .. 40000 (assumed: five riders were shaken in yaw by Doria et al. (2012), but
        their values are not public), allowed 0 .. inf; the effect vanishes at inf; negligible above 200000.
    damping : float, N m s/rad, default 130
        Of the hinge; typical 30 .. 600 (assumed: a ratio of 0.1 to 0.5), allowed 0 .. inf.

    Notes
    -----
    Source: Doria, Tognazzo & Cossalter (2012), ASME IDETC 2012, riders shaken in yaw; reports of riders.
    """

    mass: float
    mass_share: float
    x: float
    z: float
    Ixx: float
    Izz: float
    Ixz: float
    inertia_share: float
    joint_x: float
    stiffness: float
    damping: float
    def __init__(
        self,
        *,
        mass: float = ...,
        mass_share: float = 0.93,
        x: float = ...,
        z: float = ...,
        Ixx: float = ...,
        Izz: float = ...,
        Ixz: float = ...,
        inertia_share: float = 0.85,
        joint_x: float = 0.2,
        stiffness: float = 12000.0,
        damping: float = 130.0,
    ) -> None: ...

class RiderSaddleRoll(Effect):
    """A sprung, damped hinge along x at height joint_z that carries the seated rider of rider_saddle.

    It moves with the hinge along z. For roll alone give the same body to rider_lean. With rider_lean the upper body
    also leans against the seated one.

    Parameters
    ----------
    joint_z : float, m, default -0.95
        Height of the saddle, z down; typical -1.05 .. -0.85, allowed any.
    stiffness : float, N m/rad, default 3000
        Of the hinge; typical 1000 .. 5000 (assumed), allowed 0 .. inf; the effect vanishes at inf; negligible above
        30000.
    damping : float, N m s/rad, default 60
        Of the hinge; typical 15 .. 200 (assumed: a ratio of 0.1 to 0.5), allowed 0 .. inf.

    Notes
    -----
    Source: Doria, Tognazzo & Cossalter (2013), Proc. IMechE D 227, 561-576 (riders shaken in roll).
    """

    joint_z: float
    stiffness: float
    damping: float
    def __init__(
        self,
        *,
        joint_z: float = -0.95,
        stiffness: float = 3000.0,
        damping: float = 60.0,
    ) -> None: ...

class RiderSteerMemory(Effect):
    """Command gain * (integral of the steer angle) to the muscles of rider_control.

    Without slip the integral is the heading times w / (v cos lam). For a rider without such a gain leave it out.

    Parameters
    ----------
    gain : float, N m/rad s
        Torque per integral of the steer angle; typical 10 .. 650, allowed any.

    Notes
    -----
    Source: Schwab, de Lange, Happee & Moore (2013), Multibody System Dynamics, eq. of the controller (k_delta_i).
    """

    gain: float
    def __init__(
        self,
        *,
        gain: float,
    ) -> None: ...

class RotatingMass(Effect):
    """A rotor in the main frame, its axle across: it adds spin momentum, its mass is part of the frame.

    It turns ``ratio`` times as fast as the rear wheel, and ``spin`` at any speed; both are positive if it turns as the
    wheels do. Momentum h = inertia (ratio v / rR + spin): yaw rate r and lean rate p give the torques -h r about the
    forward axis and h p about the vertical.

    Parameters
    ----------
    inertia : float, kg m^2, default 0.01
        Of the rotor about its axle; typical 0 .. 0.1, allowed 0 .. inf; the effect vanishes at 0.
    ratio : float, dimensionless, default 1
        Turns for one turn of the rear wheel; typical -5 .. 20, allowed any.
    spin : float, rad/s, default 0
        Further spin, at any speed; typical -500 .. 1000, allowed any.

    Notes
    -----
    Source: Cossalter, Motorcycle Dynamics, ch. 4 (gyroscopic effects of the engine); Sharp (1971).
    """

    inertia: float
    ratio: float
    spin: float
    def __init__(
        self,
        *,
        inertia: float = 0.01,
        ratio: float = 1.0,
        spin: float = 0.0,
    ) -> None: ...

class SideSlip(Effect):
    """Lateral force without lag, F = C alpha + camber force, alpha = -s / v (s: slip velocity of the contact).

    Singular at v = 0.

    Parameters
    ----------
    cornering_stiffness : float or {rear, front}, N/rad
        Slope of the lateral force at zero slip; typical 2000 .. 12000, allowed 0 .. inf.

    Notes
    -----
    Source: Pacejka, Tire and Vehicle Dynamics, ch. 1.
    """

    cornering_stiffness: PerWheel
    def __init__(
        self,
        *,
        cornering_stiffness: PerWheelValue,
    ) -> None: ...

class SteerAssist(Effect):
    """Steer torque gain (fade_speed - v) d(lean)/dt below the fade speed, lean_gain (v - fade_speed) lean above it.

    The torque acts between rear frame and steering and steers into the fall for positive gains. It is the
    command to the motor, which acts at once unless ``steer_motor`` gives its lag. Beyond the greatest torque of a
    real motor the equations, which are linear, do not hold.

    Parameters
    ----------
    gain : float, N s^2/rad, default 5
        Torque per lean rate and per m/s below the fade speed; typical 0 .. 20, allowed any; the effect vanishes at
        0; negligible below 0.05.
    fade_speed : float, m/s, default 5
        Speed at which the assist vanishes and changes over; typical 3 .. 8, allowed 0 .. inf.
    lean_gain : float, N s/rad, default 0
        Torque per lean angle and per m/s above the fade speed; typical 0 .. 5, allowed any; the effect vanishes at
        0; negligible below 0.05.

    Notes
    -----
    Source: Schwab, Kooijman & Meijaard (2008), 4th European Conference on Structural Control, St. Petersburg.
    """

    gain: float
    fade_speed: float
    lean_gain: float
    def __init__(
        self,
        *,
        gain: float = 5.0,
        fade_speed: float = 5.0,
        lean_gain: float = 0.0,
    ) -> None: ...

class SteerDamper(Effect):
    """Torque -c d(steer)/dt between rear frame and front assembly (Sharp 1971).

    Parameters
    ----------
    damping : float, N m s/rad, default 0.5
        Steering damper; typical 0 .. 5, allowed 0 .. inf; the effect vanishes at 0; negligible below 0.02.

    Notes
    -----
    Source: Sharp (1971), J. Mech. Eng. Sci. 13(5), 316-329.
    """

    damping: float
    def __init__(
        self,
        *,
        damping: float = 0.5,
    ) -> None: ...

class SteerMotor(Effect):
    """A share of the commanded torque, after a first-order lag: lag dT/dt = share T_command - T.

    A share below 1: friction in motor and gear, a motor constant that is smaller than the controller assumes. The lag
    stands for filters of the measured motion, sampling and the motor's own current loop. The greatest torque of the
    motor is not part of it (the equations are linear).

    Parameters
    ----------
    share : float, dimensionless, default 1
        Share of the commanded torque that arrives; typical 0.4 .. 1, allowed 0 .. inf.
    lag : float, s, default 0.03
        Time in which 63 % of a step of the command arrive; typical 0.005 .. 0.1, allowed 0.0001 .. inf.

    Notes
    -----
    Source: Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems, ch. 2 (models of motors).
    """

    share: float
    lag: float
    def __init__(
        self,
        *,
        share: float = 1.0,
        lag: float = 0.03,
    ) -> None: ...

class SteerSpring(Effect):
    """Torque -k steer between rear frame and front assembly, as bent cables and hoses give.

    Parameters
    ----------
    stiffness : float, N m/rad, default 2
        Torque that centres the steering; typical 0 .. 20, allowed 0 .. inf; the effect vanishes at 0; negligible
        below 0.1.

    Notes
    -----
    Source: Schwab, Meijaard & Kooijman (2012), Vehicle System Dynamics 50 (stiffness on the steering).
    """

    stiffness: float
    def __init__(
        self,
        *,
        stiffness: float = 2.0,
    ) -> None: ...

class TwistingTorque(Effect):
    """Moment Mz = +k gamma about the vertical that turns a leaning wheel into the lean.

    The inner side of the contact patch rolls on a smaller radius than the outer side. Under no_slip it acts as well.
    With a pneumatic_trail, whose moment -t F includes the camber force, it is the remaining moment due to camber.
    Source: Cossalter, Motorcycle Dynamics, ch. 2; Pacejka, Tire and Vehicle Dynamics, ch. 11.

    Parameters
    ----------
    twisting_stiffness : float or {rear, front}, N m/rad, default 5
        Moment into the lean, per camber angle; typical 2.4 .. 12 (measured on a Schwalbe 28 x 1.75 at 300 to 600 N,
        3 to 5 bar), allowed 0 .. inf; the effect vanishes at 0; negligible below 0.1.
    """

    twisting_stiffness: PerWheel
    def __init__(
        self,
        *,
        twisting_stiffness: PerWheelValue = 5.0,
    ) -> None: ...

class UnmodelledTorque(Effect):
    """Steer and lean torque, each linear in lean, steer and their rates, with coefficients that change with speed.

    Torque = sum of (k + k_slope x + k_curve x^2) state with x = (v - middle_speed) / speed_span, so that all three have
    the unit of k, which holds at the middle speed. Positive torques act like the inputs steer_torque and lean_torque:
    a steering damper is a negative steer_from_steer_rate. It is empirical: the diagnosis fits it to what it cannot
    name. Outside the speeds of its measurement, middle_speed - speed_span to middle_speed + speed_span, it is a guess.
    Usual sizes scale sliders and the prior of that fit: of the steer torque 20 N m/rad of lean, 10 of steer, 4 and
    2 N m s/rad of their rates; of the lean torque 100, 40, 20 and 10; slopes and curvatures have the size of their k.

    Parameters
    ----------
    middle_speed : float, m/s, default 5
        Of the measurement behind it; typical 2 .. 20, allowed 0 .. inf.
    speed_span : float, m/s, default 1
        Half the range of measured speeds; typical 0.5 .. 10, allowed 0.001 .. inf.
    steer_from_lean : float, N m/rad, default 0
        Steer torque over lean, at the middle speed; typical -20 .. 20, allowed any; the effect vanishes at 0.
    steer_from_lean_slope : float, N m/rad, default 0
        Steer torque over lean, its change over a span of speed; typical -20 .. 20, allowed any; the effect vanishes
        at 0.
    steer_from_lean_curve : float, N m/rad, default 0
        Steer torque over lean, its curvature; typical -20 .. 20, allowed any; the effect vanishes at 0.
    steer_from_steer : float, N m/rad, default 0
        Steer torque over steer, at the middle speed; typical -10 .. 10, allowed any; the effect vanishes at 0.
    steer_from_steer_slope : float, N m/rad, default 0
        Steer torque over steer, its change over a span of speed; typical -10 .. 10, allowed any; the effect
        vanishes at 0.
    steer_from_steer_curve : float, N m/rad, default 0
        Steer torque over steer, its curvature; typical -10 .. 10, allowed any; the effect vanishes at 0.
    steer_from_lean_rate : float, N m s/rad, default 0
        Steer torque over lean rate, at the middle speed; typical -4 .. 4, allowed any; the effect vanishes at 0.
    steer_from_lean_rate_slope : float, N m s/rad, default 0
        Steer torque over lean rate, its change over a span of speed; typical -4 .. 4, allowed any; the effect
        vanishes at 0.
    steer_from_lean_rate_curve : float, N m s/rad, default 0
        Steer torque over lean rate, its curvature; typical -4 .. 4, allowed any; the effect vanishes at 0.
    steer_from_steer_rate : float, N m s/rad, default 0
        Steer torque over steer rate, at the middle speed; typical -2 .. 2, allowed any; the effect vanishes at 0.
    steer_from_steer_rate_slope : float, N m s/rad, default 0
        Steer torque over steer rate, its change over a span of speed; typical -2 .. 2, allowed any; the effect
        vanishes at 0.
    steer_from_steer_rate_curve : float, N m s/rad, default 0
        Steer torque over steer rate, its curvature; typical -2 .. 2, allowed any; the effect vanishes at 0.
    lean_from_lean : float, N m/rad, default 0
        Lean torque over lean, at the middle speed; typical -100 .. 100, allowed any; the effect vanishes at 0.
    lean_from_lean_slope : float, N m/rad, default 0
        Lean torque over lean, its change over a span of speed; typical -100 .. 100, allowed any; the effect
        vanishes at 0.
    lean_from_lean_curve : float, N m/rad, default 0
        Lean torque over lean, its curvature; typical -100 .. 100, allowed any; the effect vanishes at 0.
    lean_from_steer : float, N m/rad, default 0
        Lean torque over steer, at the middle speed; typical -40 .. 40, allowed any; the effect vanishes at 0.
    lean_from_steer_slope : float, N m/rad, default 0
        Lean torque over steer, its change over a span of speed; typical -40 .. 40, allowed any; the effect vanishes
        at 0.
    lean_from_steer_curve : float, N m/rad, default 0
        Lean torque over steer, its curvature; typical -40 .. 40, allowed any; the effect vanishes at 0.
    lean_from_lean_rate : float, N m s/rad, default 0
        Lean torque over lean rate, at the middle speed; typical -20 .. 20, allowed any; the effect vanishes at 0.
    lean_from_lean_rate_slope : float, N m s/rad, default 0
        Lean torque over lean rate, its change over a span of speed; typical -20 .. 20, allowed any; the effect
        vanishes at 0.
    lean_from_lean_rate_curve : float, N m s/rad, default 0
        Lean torque over lean rate, its curvature; typical -20 .. 20, allowed any; the effect vanishes at 0.
    lean_from_steer_rate : float, N m s/rad, default 0
        Lean torque over steer rate, at the middle speed; typical -10 .. 10, allowed any; the effect vanishes at 0.
    lean_from_steer_rate_slope : float, N m s/rad, default 0
        Lean torque over steer rate, its change over a span of speed; typical -10 .. 10, allowed any; the effect
        vanishes at 0.
    lean_from_steer_rate_curve : float, N m s/rad, default 0
        Lean torque over steer rate, its curvature; typical -10 .. 10, allowed any; the effect vanishes at 0.

    Notes
    -----
    Source: none: linear in the state as a controller identified by Moore (2012), Human Control of a Bicycle, ch. 8.
    """

    middle_speed: float
    speed_span: float
    steer_from_lean: float
    steer_from_lean_slope: float
    steer_from_lean_curve: float
    steer_from_steer: float
    steer_from_steer_slope: float
    steer_from_steer_curve: float
    steer_from_lean_rate: float
    steer_from_lean_rate_slope: float
    steer_from_lean_rate_curve: float
    steer_from_steer_rate: float
    steer_from_steer_rate_slope: float
    steer_from_steer_rate_curve: float
    lean_from_lean: float
    lean_from_lean_slope: float
    lean_from_lean_curve: float
    lean_from_steer: float
    lean_from_steer_slope: float
    lean_from_steer_curve: float
    lean_from_lean_rate: float
    lean_from_lean_rate_slope: float
    lean_from_lean_rate_curve: float
    lean_from_steer_rate: float
    lean_from_steer_rate_slope: float
    lean_from_steer_rate_curve: float
    def __init__(
        self,
        *,
        middle_speed: float = 5.0,
        speed_span: float = 1.0,
        steer_from_lean: float = ...,
        steer_from_lean_slope: float = ...,
        steer_from_lean_curve: float = ...,
        steer_from_steer: float = ...,
        steer_from_steer_slope: float = ...,
        steer_from_steer_curve: float = ...,
        steer_from_lean_rate: float = ...,
        steer_from_lean_rate_slope: float = ...,
        steer_from_lean_rate_curve: float = ...,
        steer_from_steer_rate: float = ...,
        steer_from_steer_rate_slope: float = ...,
        steer_from_steer_rate_curve: float = ...,
        lean_from_lean: float = ...,
        lean_from_lean_slope: float = ...,
        lean_from_lean_curve: float = ...,
        lean_from_steer: float = ...,
        lean_from_steer_slope: float = ...,
        lean_from_steer_curve: float = ...,
        lean_from_lean_rate: float = ...,
        lean_from_lean_rate_slope: float = ...,
        lean_from_lean_rate_curve: float = ...,
        lean_from_steer_rate: float = ...,
        lean_from_steer_rate_slope: float = ...,
        lean_from_steer_rate_curve: float = ...,
    ) -> None: ...

class WheelCompliance(Effect):
    """A spring K_w between hub and tyre: the relaxation length grows from C_alpha / K_y to C_alpha (1/K_y + 1/K_w).

    Rigs measure the tyre on a stiff rim; the wheel of a rider is softer. Its mass and its camber are not affected,
    and a relaxation length of aligning_moment is taken as given.

    Parameters
    ----------
    stiffness : float or {rear, front}, N/m, default 300000
        Lateral stiffness of rim and spokes at the contact; typical 100000 .. 600000, allowed 1e-06 .. inf; the
        effect vanishes at inf; negligible above 3e+06.

    Notes
    -----
    Source: Dell'Orto, Ballo, Mastinu & Gobbi, eq. 3, springs in series; Pacejka, Tire and Vehicle Dynamics, ch. 7.
    """

    stiffness: PerWheel
    def __init__(
        self,
        *,
        stiffness: PerWheelValue = 300000.0,
    ) -> None: ...
