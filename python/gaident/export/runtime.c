/* The gaident runtime: the loop that the simulation steps through. Compared with it, effect by effect.
   The same equations, fused as in the simulation: fma(a, b, c) is a b + c, rounded once. The order of its sums differs. */
#ifndef GAIDENT_RUNTIME_DEFINED
#define GAIDENT_RUNTIME_DEFINED

#include <math.h>

static double gaident_clip(double x, double limit) { return x > limit ? limit : x < -limit ? -limit : x; }

/* -- friction: w+ = w_free - beta f at the end of the substep ------------------------------------------------------------- */

typedef struct {
    double w, w_free, beta;
    double level[2], viscous[2], drag; /* torques against the motion, forwards and backwards [N m], [N m s/rad], [N m s^2/rad^2] */
    double more_at_rest;               /* what the levels at w = 0 have more [N m] */
} gaident_friction;

/* Dry friction may stop the motion or hold it. */
static double gaident_under_friction(const gaident_friction *f) {
    const double w = f->w, beta = f->beta, speed = fabs(w), change = f->w_free - w;
    const double direction = speed > 0.0 ? w : change, sign = direction > 0.0 ? 1.0 : -1.0;
    const int way = direction > 0.0 ? 0 : 1;
    const double rise = sign * change, B = 0.5 * f->viscous[way];
    const double kept = fma(-(beta * B), speed, fma(-beta, f->level[way], speed + rise));
    const double onward = kept / fma(beta, fma(f->drag, speed, B), 1.0);
    if (onward > 0.0) return sign * onward;
    {
        const double rest = onward / ((onward - speed) - 1e-300); /* share of the substep after the stop */
        const double back = fma(beta, f->level[1 - way] + f->more_at_rest, rise);
        return sign * rest * (back < 0.0 ? back : 0.0);
    }
}

static void gaident_add_level(gaident_friction *f, double level) {
    f->level[0] += level;
    f->level[1] += level;
}

/* The level between the torque Tc of motion and Ts at rest, at the mean velocity, which is foreseen, but never beyond a stop. */
static double gaident_falling(double Tc, double Ts, double slowness, double w, double w_before) {
    const double foreseen = fma(0.5, w - w_before, w), x = (w * foreseen > 0.0 ? foreseen : 0.0) * slowness;
    return fma(Ts - Tc, exp(-x * x), Tc);
}

static void gaident_stribeck(const gaident_shaft *k, gaident_shaft_memory *s, gaident_friction *f) {
    const double level = gaident_falling(k->stribeck_friction.torque, k->stribeck_friction.static_torque,
                                         k->stribeck_friction.slowness, f->w, s->stribeck_friction.w_before);
    gaident_add_level(f, level);
    f->more_at_rest = k->stribeck_friction.static_torque - level;
    s->stribeck_friction.w_before = f->w;
}

/* An elastic bristle, solved jointly with the velocity; theta weighs the end of the substep, one_plus = 1 + theta h abs(W)/zc. */
static void gaident_weigh(gaident_bristle *r, double h, double decay, double spring) {
    r->theta = 1.0 - 1.0 / fma(decay, fma(0.058, decay, 1.0 / 3.0), fma(0.5, spring, 2.0));
    r->e = r->theta * h;
}

/* The torque stiffness * (mean deflection) put into w+ = w_free - beta f. */
static void gaident_join(gaident_bristle *r, double stiffness, double per_break, gaident_friction *f) {
    const double ez = r->e * per_break, kb = r->theta * f->beta * stiffness;
    const double A = fma(r->theta, fma(-f->beta, r->other, f->w_free - f->w), f->w), drive = fma(-kb, r->z, A);
    const double c = 2.0 * ez * fabs(drive), b = fma(drive > 0.0 ? -A : A, ez, fma(kb, r->e, 1.0));
    const double q = fabs(b) + sqrt(fma(b, b, 2.0 * c)), P = 1.0 + (b > 0.0 ? c / q : 0.5 * q), stiffer = fma(kb, r->e, P);
    f->w_free = fma(P, f->w_free, -(f->beta * stiffness) * fma(r->e * (1.0 - r->theta), f->w, r->z)) / stiffer;
    f->beta *= P / stiffer;
    r->one_plus = P;
}

static void gaident_move(gaident_bristle *r, const gaident_friction *f, double w_next, double limit) {
    const double W = fma(r->theta, w_next - f->w, f->w), zm = fma(r->e, W, r->z) / r->one_plus;
    r->other = (f->w_free - w_next) / f->beta;
    r->z = gaident_clip(r->z + (zm - r->z) / r->theta, limit);
}

static void gaident_presliding(const gaident_shaft *k, gaident_shaft_memory *s, double h, gaident_friction *f) {
    const double stiffness = k->presliding_friction.stiffness, per_break = k->presliding_friction.per_break;
    gaident_weigh(&s->presliding_friction, h, h * fabs(f->w) * per_break, f->beta * h * stiffness);
    gaident_join(&s->presliding_friction, stiffness, per_break, f);
}

static void gaident_lugre(const gaident_shaft *k, gaident_shaft_memory *s, double h, gaident_friction *f) {
    const double Ts = k->lugre_friction.static_torque, stiffness = k->lugre_friction.stiffness, damping = k->lugre_friction.damping;
    const double g = gaident_falling(k->lugre_friction.torque, Ts, k->lugre_friction.slowness, f->w, s->lugre_friction.w_before);
    const double per_break = stiffness / fmax(g, 1e-6 * Ts);
    gaident_bristle *r = &s->lugre_friction.bristle;
    double bending;
    gaident_weigh(r, h, fma(h * fabs(f->w), per_break, f->beta * damping), f->beta * h * stiffness);
    bending = k->lugre_friction.damping_per_step / r->theta;
    f->w_free = fma(f->beta * bending, r->z, f->w_free);
    gaident_join(r, stiffness + bending, per_break, f);
    s->lugre_friction.w_before = f->w;
}

/* Drag c sqrt(W) at the mean velocity W = A - b sqrt(W) in the direction of motion, a level that is 0 at rest. */
static void gaident_root(const gaident_shaft *k, gaident_friction *f) {
    const double speed = fabs(f->w), way = speed > 0.0 ? f->w : f->w_free;
    const int at = way > 0.0 ? 0 : 1;
    const double B = 0.5 * f->viscous[at], per = 1.0 / fma(f->beta, fma(f->drag, speed, B), 1.0);
    const double ahead = fma(-(f->beta * B), speed, fma(-f->beta, f->level[at], way > 0.0 ? f->w_free : -f->w_free)) * per;
    const double A = 0.5 * (speed + ahead), b = 0.5 * f->beta * k->square_root_drag.coefficient * per;
    const double drag = A > 0.0 ? k->square_root_drag.coefficient * 2.0 * A / (b + sqrt(fma(b, b, 4.0 * A))) : 0.0;
    gaident_add_level(f, drag);
    f->more_at_rest -= drag;
}

/* Whether friction or a change of the inertia acts at the end of the shaft. */
static int gaident_changes(const gaident_drive *k, int load) {
    return (k->effects & GAIDENT_POSITION_INERTIA) && load == k->two_masses;
}

/* Whether effects act at the load, or the coupling has a memory: what a rise of the torque makes of the state is then apart from it. */
static int gaident_loaded(const gaident_drive *k) {
    return k->two_masses && (k->at_load.effects || (k->effects & (GAIDENT_HYSTERETIC_COUPLING | GAIDENT_POSITION_INERTIA)));
}

static int gaident_stiff(const gaident_drive *k, int load) {
    return ((load ? &k->at_load : &k->at_motor)->effects & GAIDENT_DRY) || gaident_changes(k, load);
}

/* A change of the inertia: w+ (1 + beta (change cos(psi) - bend sin(psi) w)) = w_free + beta change cos(psi) w - beta f. */
static void gaident_turned(const gaident_drive *k, double theta, gaident_friction *f) {
    const double psi = fma(k->position_inertia.order, theta, k->position_inertia.phase);
    const double change = k->position_inertia.change * cos(psi), bend = k->position_inertia.bend * sin(psi);
    const double per = 1.0 / fma(f->beta, fma(-bend, f->w, change), 1.0);
    f->w_free = fma(f->beta * change, f->w, f->w_free) * per;
    f->beta *= per;
}

/* w+ of an end of the shaft at w, and w_free without friction; t: time in the middle of the substep. */
static double gaident_dry(const gaident_drive *drive, gaident_memory *memory, int load, double w, double w_free, double beta,
                          double t) {
    const gaident_shaft *k = load ? &drive->at_load : &drive->at_motor;
    gaident_shaft_memory *s = load ? &memory->at_load : &memory->at_motor;
    const double h = drive->h;
    gaident_friction f = {0.0, 0.0, 0.0, {0.0, 0.0}, {0.0, 0.0}, 0.0, 0.0};
    double w_next;
    f.w = w;
    f.w_free = w_free;
    f.beta = beta;
    if (gaident_changes(drive, load)) gaident_turned(drive, s->theta, &f);
    gaident_add_level(&f, k->coulomb_friction.torque);
    f.level[0] += k->asymmetric_friction.torque_positive;
    f.level[1] += k->asymmetric_friction.torque_negative;
    f.viscous[0] = k->asymmetric_friction.viscous_positive;
    f.viscous[1] = k->asymmetric_friction.viscous_negative;
    f.drag = k->quadratic_drag.coefficient;
    if (k->effects & GAIDENT_FRICTION_DRIFT)
        gaident_add_level(&f, k->friction_drift.torque * fmax(fma(k->friction_drift.rate, t, 1.0), 0.0));
    if (k->effects & GAIDENT_LOAD_DEPENDENT_FRICTION)
        gaident_add_level(&f, fma(k->load_dependent_friction.share, fabs(s->braking), k->load_dependent_friction.torque));
    if (k->effects & GAIDENT_POSITION_FRICTION)
        gaident_add_level(&f, fma(k->position_friction.change,
                                  cos(fma(k->position_friction.order, s->theta, k->position_friction.phase)),
                                  k->position_friction.torque));
    if (k->effects & GAIDENT_STRIBECK_FRICTION) gaident_stribeck(k, s, &f);
    if (k->effects & GAIDENT_PRESLIDING_FRICTION) gaident_presliding(k, s, h, &f);
    if (k->effects & GAIDENT_LUGRE_FRICTION) gaident_lugre(k, s, h, &f);
    if (k->effects & GAIDENT_SQUARE_ROOT_DRAG) gaident_root(k, &f);
    w_next = gaident_under_friction(&f);
    if (k->effects & GAIDENT_PRESLIDING_FRICTION)
        gaident_move(&s->presliding_friction, &f, w_next, k->presliding_friction.limit);
    if (k->effects & GAIDENT_LUGRE_FRICTION)
        gaident_move(&s->lugre_friction.bristle, &f, w_next, k->lugre_friction.limit);
    return w_next;
}

/* The torque that brakes at the angle theta. */
static double gaident_braking(const gaident_shaft *k, double theta) {
    double T = 0.0;
    int i;
    if (k->effects & GAIDENT_LOAD_TORQUE) T += k->load_torque.load;
    if (k->effects & GAIDENT_UNBALANCE) T += k->unbalance.amplitude * sin(theta + k->unbalance.phase);
    if (k->effects & GAIDENT_COGGING) T += k->cogging.amplitude * sin(fma(k->cogging.order, theta, k->cogging.phase));
    if (k->effects & GAIDENT_COGGING_WAVES)
        for (i = 0; i < GAIDENT_WAVES; ++i)
            if (k->cogging_waves[i].amplitude != 0.0)
                T += k->cogging_waves[i].amplitude * sin(fma(k->cogging_waves[i].order, theta, k->cogging_waves[i].phase));
    return T;
}

/* The torque that drives this end whatever it does, in the middle of the substep. */
static double gaident_hum(const gaident_shaft *k, double t) {
    return k->effects & GAIDENT_TORQUE_HUM ? k->torque_hum.mean * sin(fma(k->torque_hum.turns, t, k->torque_hum.phase)) : 0.0;
}

/* -- coupling: what play, hardening and hysteresis add to the linear coupling torque -------------------------------------------------- */

/* At the twist x and its rate dx. */
static double gaident_correction(const gaident_drive *k, double x, double dx) {
    const double gap = k->backlash.half_gap, beyond = x - gaident_clip(x, gap);
    return -fma(k->stiffness, gaident_clip(x, gap), gap > fabs(x) ? k->damping * dx : 0.0) +
           k->hardening_stiffness.cubic * beyond * beyond * beyond;
}

/* Its mean along a twist that goes evenly from x0 to x1. */
static double gaident_mean_correction(const gaident_drive *k, double x0, double x1, double dx) {
    const double gap = k->backlash.half_gap, c0 = gaident_clip(x0, gap), c1 = gaident_clip(x1, gap), step = x1 - x0;
    const double b0 = x0 - c0, b1 = x1 - c1, S = fma(c1, fma(-0.5, c1, x1), -(c0 * fma(-0.5, c0, x0)));
    const int moves = fabs(step) > 1e-6 * gap;
    const double spring = moves ? S / step : 0.5 * (c0 + c1);
    const double share = moves ? (c1 - c0) / step : gap > fabs(x0) ? 1.0 : 0.0;
    return -fma(k->stiffness, spring, k->damping * dx * share) +
           0.5 * k->hardening_stiffness.cubic * (b0 * b0 * b0 + b1 * b1 * b1);
}

/* (a - 1 + e^-a)/a^2, a >= 0 */
static double gaident_mean_share(double a) {
    double series = 0.0;
    int k;
    if (a > 0.125) return (a - (1.0 - exp(-a))) / (a * a);
    for (k = 11; k >= 2; --k) series = fma(-a, series, 1.0) / k;
    return series;
}

/* The torque of the coupling's bristle at the twist x, to which it has gone evenly; its mean from there to the twist x. */
static double gaident_wound(const gaident_drive *k, gaident_memory *s, double x) {
    const double way = x - s->hysteretic_coupling.x, length = fabs(way), a = length * k->hysteretic_coupling.per_break;
    const double z = s->hysteretic_coupling.z, bent = fma(-(z * k->hysteretic_coupling.per_break), length, way);
    s->hysteretic_coupling.z = fma(bent, fma(-a, gaident_mean_share(a), 1.0), z);
    s->hysteretic_coupling.x = x;
    return k->hysteretic_coupling.stiffness * s->hysteretic_coupling.z;
}

static double gaident_mean_wound(const gaident_drive *k, const gaident_memory *s, double x) {
    const double way = x - s->hysteretic_coupling.x, length = fabs(way), z = s->hysteretic_coupling.z;
    const double bent = fma(-(z * k->hysteretic_coupling.per_break), length, way);
    return k->hysteretic_coupling.stiffness * fma(bent, gaident_mean_share(length * k->hysteretic_coupling.per_break), z);
}

/* -- the mechanism over one substep under the torque T -------------------------------------------------------------------- */

static void gaident_observer(const gaident_drive *k, gaident_memory *s, double T, double t) {
    const int n = k->order;
    const double w = s->x[0], w_free = fma(-k->a[0], w, fma(k->b[1], T, w)) + (n > 1 ? s->x[1] : 0.0);
    double w_next = w_free;
    int i;
    if (gaident_stiff(k, 0)) {
        w_next = gaident_dry(k, s, 0, w, w_free, k->b[1], t);
        T -= (w_free - w_next) / k->b[1];
    }
    for (i = 1; i < n; ++i) s->x[i] = fma(-k->a[i], w, fma(k->b[i + 1], T, s->x[i])) + (i + 1 < n ? s->x[i + 1] : 0.0);
    s->x[0] = w_next;
}

/* Both ends of the shaft under friction: each mass sticks or slips.
   The load's equation is solved with what the motor does, which is found with the load's friction of the round before;
   the rounds converge to rounding error. */
static void gaident_both_dry(const gaident_drive *k, gaident_memory *s, double w_free, double w_free_load, double t, double *w_next,
                             double *w_next_load) {
    const double across = k->motor[0] + k->coupling[0], back = k->motor[1], beta = k->motor[0], beta_load = k->motor[1] + k->coupling[1];
    const gaident_shaft_memory motor = s->at_motor, load = s->at_load;
    double f = 0.0, f_load = load.friction;
    int round;
    for (round = 0; round < 2; ++round) {
        double free = fma(-across, f_load, w_free), b = beta_load;
        s->at_motor = motor;
        s->at_load = load;
        *w_next = gaident_dry(k, s, 0, s->x[0], free, beta, t);
        f = (free - *w_next) / beta;
        free = fma(-back, f, w_free_load);
        if (*w_next == 0.0) {
            free = fma(-(back / beta), w_free, w_free_load);
            b = fma(-(back / beta), across, b);
        }
        *w_next_load = gaident_dry(k, s, 1, s->x[1], free, b, t);
        f_load = (free - *w_next_load) / b;
    }
    s->at_motor.friction = (fma(-across, f_load, w_free) - *w_next) / beta;
    s->at_load.friction = f_load;
}

static void gaident_masses(const gaident_drive *k, gaident_memory *s, double T, double t) {
    const double x0 = s->x[2] * k->per_scale, dx0 = s->x[0] - s->x[1];
    double free[3], end[3], load[3], T_load, now, mean, x1, w_next, w_next_load;
    int i;
    for (i = 0; i < 3; ++i) load[i] = k->motor[i] + k->coupling[i];
    s->at_load.theta = fma(0.5 * k->h, s->x[1], s->angle) - x0;
    s->at_load.braking = gaident_braking(&k->at_load, s->at_load.theta);
    T_load = gaident_hum(&k->at_load, t) - s->at_load.braking;
    for (i = 0; i < 3; ++i) {
        free[i] = fma(k->phi[3 * i], s->x[0], fma(k->motor[i], T, s->x[i])) +
                  fma(k->phi[3 * i + 2], s->x[2], k->phi[3 * i + 1] * s->x[1]);
        free[i] = fma(load[i], T_load, free[i]) + fma(k->phi[3 * i + 2], s->late[1], k->phi[3 * i + 1] * s->late[0]);
        if (i > 0) free[i] += s->late[i - 1];
        end[i] = fma(-load[i], s->at_load.friction, fma(-k->motor[i], s->at_motor.friction, free[i]));
    }
    now = gaident_correction(k, x0, dx0);
    if (k->effects & GAIDENT_HYSTERETIC_COUPLING) now += gaident_wound(k, s, x0);
    x1 = fma(k->coupling[2], now, end[2]) * k->per_scale;
    mean = gaident_mean_correction(k, x0, x1, 0.5 * (dx0 + fma(k->coupling[0] - k->coupling[1], now, end[0] - end[1])));
    if (k->effects & GAIDENT_HYSTERETIC_COUPLING) mean += gaident_mean_wound(k, s, x1);
    for (i = 0; i < 3; ++i) free[i] = fma(k->coupling[i], mean, free[i]);
    w_next = free[0];
    w_next_load = free[1];
    if (gaident_stiff(k, 0) && gaident_stiff(k, 1)) {
        gaident_both_dry(k, s, free[0], free[1], t, &w_next, &w_next_load);
    } else if (gaident_stiff(k, 1)) {
        w_next_load = gaident_dry(k, s, 1, s->x[1], free[1], load[1], t);
        s->at_load.friction = (free[1] - w_next_load) / load[1];
        w_next = fma(-load[0], s->at_load.friction, w_next);
    } else if (gaident_stiff(k, 0)) {
        w_next = gaident_dry(k, s, 0, s->x[0], free[0], k->motor[0], t);
        s->at_motor.friction = (free[0] - w_next) / k->motor[0];
        w_next_load = fma(-k->motor[1], s->at_motor.friction, w_next_load);
    }
    s->x[0] = w_next;
    s->x[1] = w_next_load;
    s->x[2] = fma(-load[2], s->at_load.friction, fma(-k->motor[2], s->at_motor.friction, free[2]));
}

/* -- the loop ------------------------------------------------------------------------------------------------------------- */

static double gaident_measured(const gaident_drive *k, const gaident_memory *s) {
    double sum = 1.0;
    int i;
    if (k->effects & GAIDENT_VELOCITY_RIPPLE_WAVES) {
        for (i = 0; i < GAIDENT_WAVES; ++i)
            if (k->velocity_ripple_waves[i].amplitude != 0.0)
                sum += k->velocity_ripple_waves[i].amplitude * k->velocity_ripple_waves[i].order *
                       cos(k->velocity_ripple_waves[i].order * s->angle + k->velocity_ripple_waves[i].phase);
        return s->x[0] * sum;
    }
    if (!(k->effects & GAIDENT_VELOCITY_RIPPLE)) return s->x[0];
    return s->x[0] * (1.0 + k->velocity_ripple.amplitude * k->velocity_ripple.order *
                                cos(k->velocity_ripple.order * s->angle + k->velocity_ripple.phase));
}

/* What the sensor shows after a substep, through what is in series there: the last of them that there is. */
static double gaident_shown(const gaident_drive *k, const gaident_memory *s) {
    if (k->effects & GAIDENT_VELOCITY_FILTER) return s->velocity_filter.output;
    if (k->effects & GAIDENT_VELOCITY_OBSERVER) return s->velocity_observer.output;
    if (k->effects & GAIDENT_VELOCITY_DIFFERENCE) return s->velocity_difference.output;
    return gaident_measured(k, s);
}

/* The mean velocity over the last samples. */
static double gaident_difference(const gaident_drive *k, gaident_memory *s, double now, double bend) {
    double left, all;
    int i;
    s->velocity_difference.steps += 1.0;
    s->velocity_difference.sum =
        fma(k->velocity_difference.step, fma(s->velocity_difference.w + now, 0.5, bend), s->velocity_difference.sum);
    s->velocity_difference.w = now;
    if (s->velocity_difference.steps > k->velocity_difference.last) {
        for (i = GAIDENT_DIFFERENCES - 1; i > 0; --i) s->velocity_difference.mean[i] = s->velocity_difference.mean[i - 1];
        s->velocity_difference.mean[0] = s->velocity_difference.sum;
        s->velocity_difference.sum = s->velocity_difference.steps = 0.0;
    }
    left = fma(-k->velocity_difference.step, s->velocity_difference.steps, k->velocity_difference.samples);
    all = s->velocity_difference.sum;
    for (i = 0; i < GAIDENT_DIFFERENCES; ++i) {
        const double part = fmin(fmax(left - i, 0.0), 1.0), *m = s->velocity_difference.mean;
        const double slope = m[i > 0 ? i - 1 : 0] - m[i + 1 < GAIDENT_DIFFERENCES ? i + 1 : i];
        all = fma(part, fma(0.25 * (1.0 - part), slope, m[i]), all);
    }
    return s->velocity_difference.output = all * k->velocity_difference.per_samples;
}

/* *bend: of the velocity, then of what is given back; but for a servo what is behind it takes that for a straight line. */
static double gaident_track(const gaident_drive *k, gaident_memory *s, double now, double *bend) {
    const double step = now - s->velocity_observer.w, behind = s->velocity_observer.output - s->velocity_observer.w;
    const double slope = s->velocity_observer.slope, output = s->velocity_observer.output;
    double ends, moved;
    s->velocity_observer.output =
        now + fma(k->velocity_observer.of_bend, *bend,
                  fma(k->velocity_observer.of_step, step,
                      fma(k->velocity_observer.of_v, slope, k->velocity_observer.of_y * behind)));
    s->velocity_observer.slope =
        fma(k->velocity_observer.slope_of_bend, *bend,
            fma(k->velocity_observer.slope_of_step, step,
                fma(k->velocity_observer.slope_of_v, slope, k->velocity_observer.slope_of_y * behind)));
    s->velocity_observer.w = now;
    ends = (now - s->velocity_observer.output) - behind;
    moved = fma(s->velocity_observer.output - output, 2.0, s->velocity_observer.slope - slope);
    *bend = k->servo ? fma(-moved, k->velocity_observer.lag, fma(ends, 0.5, *bend)) : 0.0;
    return s->velocity_observer.output;
}

static double gaident_filter(const gaident_drive *k, gaident_memory *s, double now, double bend) {
    const double before = k->velocity_filter.decay * s->velocity_filter.output;
    s->velocity_filter.output =
        fma(k->velocity_filter.of_bend, bend,
            fma(k->velocity_filter.of_new, now, fma(k->velocity_filter.of_old, s->velocity_filter.w, before)));
    s->velocity_filter.w = now;
    return s->velocity_filter.output;
}

/* A linear drive: the velocity answers within the sample where b[0] is not 0, so that the loop is solved, then limited. */
static double gaident_linear_step(const gaident_drive *k, gaident_memory *s, double input, double *torque) {
    double u = input, y;
    int i;
    if (k->closed) {
        const double lead = input - s->x[0], b0 = k->b[0];
        const double unlimited = fma(-b0, s->stored, lead) / fma(b0, k->kp + k->g, 1.0);
        const double I = gaident_clip(fma(k->g, unlimited, s->stored), k->integrator_limit);
        double e;
        u = gaident_clip(fma(k->kp, fma(-b0, I, lead) / fma(b0, k->kp, 1.0), I), k->torque_limit);
        e = fma(-b0, u, lead);
        s->stored = fma(k->g, e, gaident_clip(fma(k->g, e, s->stored), k->integrator_limit));
    }
    y = fma(k->b[0], u, s->x[0]);
    for (i = 0; i < k->order; ++i)
        s->x[i] = fma(-k->a[i], y, fma(k->b[i + 1], u, s->x[i] + (i + 1 < k->order ? s->x[i + 1] : 0.0)));
    *torque = u;
    return y;
}

/* What a controller reads. */
static double gaident_reading(const gaident_drive *k, const gaident_memory *s) {
    const double y = gaident_shown(k, s), step = k->velocity_quantisation.step;
    return k->effects & GAIDENT_VELOCITY_QUANTISATION ? nearbyint(y / step) * step : y;
}

/* The velocity command as the effects let it pass. */
static double gaident_followed(const gaident_drive *k, gaident_memory *s, double r) {
    if (!(k->effects & GAIDENT_COMMAND_RATE_LIMIT)) return r;
    return s->command_rate_limit.before += gaident_clip(r - s->command_rate_limit.before, k->command_rate_limit.step);
}

static double gaident_integrator_limit(const gaident_drive *k) {
    return k->effects & GAIDENT_INTEGRATOR_CLAMP ? fmin(k->integrator_limit, k->integrator_clamp.limit) : k->integrator_limit;
}

/* The torque u is issued, then come the substeps of the sample. `issued`: torques on their way. */
static void gaident_act(const gaident_drive *k, gaident_memory *s, double *issued, double u) {
    int j;
    if (k->effects & GAIDENT_TORQUE_SATURATION) u = gaident_clip(u, k->torque_saturation.limit);
    if (k->effects & GAIDENT_TORQUE_DEAD_BAND) u -= gaident_clip(u, k->torque_dead_band.width);
    if (k->effects & GAIDENT_TRANSPORT_DELAY) {
        s->newest = (s->newest + 1) % k->transport_delay.length;
        issued[s->newest] = u;
    }
    for (j = 0; j < k->substeps; ++j) {
        const double w = s->x[0];
        double T = u, rise = 0.0, bend, before[GAIDENT_ORDER], y_next; /* T: mean of the torque, and its rise about it */
        int i;
        for (i = 0; i < k->order; ++i) before[i] = s->x[i];
        if (k->effects & GAIDENT_TRANSPORT_DELAY) {
            const int back = k->transport_delay.back[j], length = k->transport_delay.length;
            const double old = issued[(s->newest - back + length) % length];
            const double young = issued[(s->newest - back + (back > 0) + length) % length];
            T = fma(young - old, k->transport_delay.share[j], old);
            rise = 6.0 * k->transport_delay.share[j] * (young - T);
        }
        if (k->effects & GAIDENT_TORQUE_LAG) {
            const double gap = s->torque_lag.T - T;
            s->torque_lag.T = fma(rise, k->torque_lag.decay_of_rise, fma(gap, k->torque_lag.decay, T));
            T = fma(rise, k->torque_lag.mean_of_rise, fma(gap, k->torque_lag.mean, T));
            rise = fma(rise, k->torque_lag.rise_of_rise, gap * k->torque_lag.rise);
        }
        s->late[0] = s->late[1] = 0.0;
        if (k->effects & (GAIDENT_TRANSPORT_DELAY | GAIDENT_TORQUE_LAG)) {
            T = fma(k->rise[0], rise, T);
            if (gaident_loaded(k))
                for (i = 0; i < 2; ++i) s->late[i] = k->rise[i + 1] * rise;
            else
                for (i = 1; i < k->order; ++i) s->x[i] = fma(k->rise[i], rise, s->x[i]);
        }
        s->at_motor.theta = s->theta;
        s->at_motor.braking = gaident_braking(&k->at_motor, s->theta);
        T += gaident_hum(&k->at_motor, s->time + 0.5 * k->h) - s->at_motor.braking;
        s->theta = fma(1.5 * k->h, w, s->angle);
        if (k->two_masses) gaident_masses(k, s, T, s->time + 0.5 * k->h);
        else gaident_observer(k, s, T, s->time + 0.5 * k->h);
        s->time += k->h;
        s->angle = fma(0.5 * k->h, w + s->x[0], s->angle);
        y_next = gaident_measured(k, s);
        /* the mean of the velocity over the substep beside that of its ends */
        bend = fma(k->bend_of[1], s->x[1], fma(k->bend_of[0], s->x[0], k->bend_of[2] * rise));
        for (i = 0; i < k->order; ++i) bend = fma(k->bend[i], before[i], bend);
        if (before[0] == 0.0 && s->x[0] == 0.0) bend = 0.0; /* it sticks */
        if (k->effects & GAIDENT_VELOCITY_DIFFERENCE) {
            y_next = gaident_difference(k, s, y_next, bend);
            bend = 0.0;
        }
        if (k->effects & GAIDENT_VELOCITY_OBSERVER) y_next = gaident_track(k, s, y_next, &bend);
        if (k->effects & GAIDENT_VELOCITY_FILTER) gaident_filter(k, s, y_next, bend);
    }
}

/* A drive with effects: velocity read, torque issued, then the substeps. */
static double gaident_effects_step(const gaident_drive *k, gaident_memory *s, double *issued, double input, double *torque) {
    const double y = gaident_reading(k, s);
    double u = input;
    if (k->closed) {
        const double e = gaident_followed(k, s, input) - y;
        const double I = gaident_clip(fma(k->g, e, s->stored), gaident_integrator_limit(k));
        s->stored = fma(k->g, e, I);
        u = gaident_clip(fma(k->kp, e, I), k->torque_limit);
    }
    *torque = u;
    gaident_act(k, s, issued, u);
    return y;
}

/* -- the controller of a servo axis, at its own clock --------------------------------------------------------------------- */

static double gaident_filtered(const gaident_filters *c, gaident_filters_memory *m, double u) {
    int i;
    for (i = 0; i < c->count; ++i) {
        const double y = fma(c->filter[i].b0, u, m->x1[i]);
        m->x1[i] = fma(-c->filter[i].a1, y, fma(c->filter[i].b1, u, m->x2[i]));
        m->x2[i] = fma(-c->filter[i].a2, y, c->filter[i].b2 * u);
        u = y;
    }
    return u;
}

/* v*, the velocity command or the slope of the position command, and what is fed forward of the torque: of v* and of its slope.
   The slopes are those over the coming period, so that input[position_every], ... are read; or those over the past one, before
   whose first the command stood still. */
static double gaident_feedforward(const gaident_servo *c, gaident_servo_memory *m, const double *input) {
    const int n = c->position_every, placed = c->position_gain != 0.0;
    const double period = c->slope_time;
    double v, slope = 0.0, pushed, rubbed;
    if (!c->feeds) return 0.0;
    if (c->past) {
        v = !placed ? input[0] : m->begun ? (input[0] - m->command_before) / period : 0.0;
        slope = m->begun ? (v - m->velocity_before) / period : 0.0;
        m->begun = 1;
        m->command_before = input[0];
        m->velocity_before = v;
    } else {
        v = placed ? (input[n] - input[0]) / period : input[0];
        if (c->acceleration_feedforward != 0.0) slope = ((placed ? (input[2 * n] - input[n]) / period : input[n]) - v) / period;
    }
    pushed = c->acceleration_feedforward * slope;
    rubbed = c->friction_feedforward * (v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0);
    m->fed = pushed + rubbed;
    return v;
}

/* The velocity command; the position controller acts at some of the samples, and its command is held until the next. */
static double gaident_servo_command(const gaident_servo *c, gaident_servo_memory *m, const double *input, double angle) {
    if (m->until == 0) {
        const double forward = c->velocity_feedforward * gaident_feedforward(c, m, input);
        m->until = c->position_every;
        m->asked = c->position_gain != 0.0 ? fma(c->position_gain, input[0] - angle, forward) : input[0];
    }
    --m->until;
    return gaident_filtered(&c->command_filters, &m->command, m->asked);
}

/* The torque under the velocity command r at the measured velocity, as csrc/gaident/control/servo.hpp has it. */
static double gaident_servo_torque(const gaident_drive *k, gaident_memory *s, gaident_servo_memory *m, double r, double measured) {
    const gaident_servo *c = k->servo;
    const double w = gaident_filtered(&c->velocity_filters, &m->velocity, measured), e = r - w;
    const double proportional = fma(k->kp, fma(c->command_weight, r, -w), m->fed);
    double I = gaident_clip(fma(k->g, e, s->stored), gaident_integrator_limit(k));
    const double v = proportional + I;
    double u = gaident_clip(v, k->torque_limit);
    if (c->anti_windup == GAIDENT_TRACKING) {
        I = fma(u - v, c->tracking, I);
    } else if (c->anti_windup == GAIDENT_HOLD && (v - u) * e > 0.0) { /* limited, and driven further */
        I = m->integral;
        u = gaident_clip(proportional + I, k->torque_limit);
    }
    m->integral = I;
    s->stored = fma(c->before, e, I);
    return gaident_filtered(&c->torque_filters, &m->torque, u);
}

/* The controller's samples of a step; what is given back is of the first of them. */
static double gaident_servo_step(const gaident_drive *k, gaident_memory *s, gaident_servo_memory *m, double *issued,
                                 const double *input, double *torque) {
    double y = 0.0;
    int i;
    for (i = 0; i < k->servo->samples; ++i) {
        const double w = gaident_reading(k, s), r = gaident_followed(k, s, gaident_servo_command(k->servo, m, input + i, s->angle));
        const double u = gaident_servo_torque(k, s, m, r, w);
        if (i == 0) {
            y = w;
            *torque = u;
        }
        gaident_act(k, s, issued, u);
    }
    return y;
}

/* One step under an input, or with a servo several; `servo` is its memory. */
static double gaident_step(const gaident_drive *k, gaident_memory *s, gaident_servo_memory *servo, double *issued,
                           const double *input, double *torque) {
    if (k->servo) return gaident_servo_step(k, s, servo, issued, input, torque);
    if (k->substeps > 0) return gaident_effects_step(k, s, issued, *input, torque);
    return gaident_linear_step(k, s, *input, torque);
}

#endif
