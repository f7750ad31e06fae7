/* The gaident runtime: the loop that the simulation steps through. Compared with it, effect by effect. */
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
    const double onward = ((speed + rise) - beta * f->level[way] - beta * B * speed) / (1.0 + beta * (B + f->drag * speed));
    if (onward > 0.0) return sign * onward;
    {
        const double rest = onward / ((onward - speed) - 1e-300); /* share of the substep after the stop */
        const double back = rise + beta * (f->level[1 - way] + f->more_at_rest);
        return sign * rest * (back < 0.0 ? back : 0.0);
    }
}

static void gaident_add_level(gaident_friction *f, double level) {
    f->level[0] += level;
    f->level[1] += level;
}

/* The level between the torque Tc of motion and Ts at rest, at the mean velocity, which is foreseen, but never beyond a stop. */
static double gaident_falling(double Tc, double Ts, double slowness, double w, double w_before) {
    const double foreseen = w + 0.5 * (w - w_before), x = (w * foreseen > 0.0 ? foreseen : 0.0) * slowness;
    return Tc + (Ts - Tc) * exp(-x * x);
}

static void gaident_stribeck(const gaident_shaft *k, gaident_shaft_memory *s, gaident_friction *f) {
    const double level = gaident_falling(k->stribeck_friction.torque, k->stribeck_friction.static_torque,
                                         k->stribeck_friction.slowness, f->w, s->stribeck_friction.w_before);
    gaident_add_level(f, level);
    f->more_at_rest = k->stribeck_friction.static_torque - level;
    s->stribeck_friction.w_before = f->w;
}

/* An elastic bristle, solved jointly with the velocity; theta weighs the end of the substep, e = theta h, one_plus = 1 + e abs(W)/zc. */
static void gaident_weigh(gaident_bristle *r, double h, double decay, double spring) {
    r->theta = 1.0 - 1.0 / (2.0 + decay / 3.0 + 0.058 * decay * decay + 0.5 * spring);
    r->e = r->theta * h;
}

/* The torque stiffness * (mean deflection) put into w+ = w_free - beta f. */
static void gaident_join(gaident_bristle *r, double stiffness, double per_break, gaident_friction *f) {
    const double ez = r->e * per_break, kb = r->theta * f->beta * stiffness;
    const double A = f->w + r->theta * ((f->w_free - f->w) - f->beta * r->other), drive = A - kb * r->z;
    const double c = fabs(drive), b = (1.0 + kb * r->e) - (drive > 0.0 ? A : -A) * ez;
    const double q = fabs(b) + sqrt(b * b + 4.0 * ez * c), V = b > 0.0 ? 2.0 * c / q : q / (2.0 * ez);
    double slope, stiffer;
    r->one_plus = 1.0 + ez * V;
    slope = stiffness * r->e / r->one_plus;
    stiffer = 1.0 + f->beta * slope * r->theta;
    f->w_free = (f->w_free - f->beta * (stiffness * r->z / r->one_plus + slope * (1.0 - r->theta) * f->w)) / stiffer;
    f->beta /= stiffer;
}

static void gaident_move(gaident_bristle *r, const gaident_friction *f, double w_next, double limit) {
    const double W = f->w + r->theta * (w_next - f->w), zm = (r->z + r->e * W) / r->one_plus;
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
    gaident_weigh(r, h, h * fabs(f->w) * per_break + f->beta * damping, f->beta * h * stiffness);
    bending = damping / r->e;
    f->w_free += f->beta * bending * r->z;
    gaident_join(r, stiffness + bending, per_break, f);
    s->lugre_friction.w_before = f->w;
}

/* w+ of this end of the shaft at w, and w_free without friction; t: time in the middle of the substep h. */
static double gaident_dry(const gaident_shaft *k, gaident_shaft_memory *s, double h, double w, double w_free, double beta, double t) {
    gaident_friction f = {0.0, 0.0, 0.0, {0.0, 0.0}, {0.0, 0.0}, 0.0, 0.0};
    double w_next;
    f.w = w;
    f.w_free = w_free;
    f.beta = beta;
    gaident_add_level(&f, k->coulomb_friction.torque);
    f.level[0] += k->asymmetric_friction.torque_positive;
    f.level[1] += k->asymmetric_friction.torque_negative;
    f.viscous[0] = k->asymmetric_friction.viscous_positive;
    f.viscous[1] = k->asymmetric_friction.viscous_negative;
    f.drag = k->quadratic_drag.coefficient;
    if (k->effects & GAIDENT_FRICTION_DRIFT)
        gaident_add_level(&f, k->friction_drift.torque * fmax(1.0 + k->friction_drift.rate * t, 0.0));
    if (k->effects & GAIDENT_LOAD_DEPENDENT_FRICTION)
        gaident_add_level(&f, k->load_dependent_friction.torque + k->load_dependent_friction.share * fabs(s->braking));
    if (k->effects & GAIDENT_STRIBECK_FRICTION) gaident_stribeck(k, s, &f);
    if (k->effects & GAIDENT_PRESLIDING_FRICTION) gaident_presliding(k, s, h, &f);
    if (k->effects & GAIDENT_LUGRE_FRICTION) gaident_lugre(k, s, h, &f);
    w_next = gaident_under_friction(&f);
    if (k->effects & GAIDENT_PRESLIDING_FRICTION)
        gaident_move(&s->presliding_friction, &f, w_next, 1.0 / k->presliding_friction.per_break);
    if (k->effects & GAIDENT_LUGRE_FRICTION)
        gaident_move(&s->lugre_friction.bristle, &f, w_next, k->lugre_friction.static_torque / k->lugre_friction.stiffness);
    return w_next;
}

/* The torque that brakes at the angle theta. */
static double gaident_braking(const gaident_shaft *k, double theta) {
    double T = 0.0;
    if (k->effects & GAIDENT_LOAD_TORQUE) T += k->load_torque.load;
    if (k->effects & GAIDENT_UNBALANCE) T += k->unbalance.amplitude * sin(theta + k->unbalance.phase);
    if (k->effects & GAIDENT_COGGING) T += k->cogging.amplitude * sin(k->cogging.order * theta + k->cogging.phase);
    return T;
}

/* -- coupling: what play and hardening add to the linear coupling torque -------------------------------------------------- */

/* At the twist x and its rate dx. */
static double gaident_correction(const gaident_drive *k, double x, double dx) {
    const double gap = k->backlash.half_gap, beyond = x - gaident_clip(x, gap);
    return -(k->stiffness * gaident_clip(x, gap) + (gap > fabs(x) ? k->damping * dx : 0.0)) +
           k->hardening_stiffness.cubic * beyond * beyond * beyond;
}

/* Its mean along a twist that goes evenly from x0 to x1. */
static double gaident_mean_correction(const gaident_drive *k, double x0, double x1, double dx) {
    const double gap = k->backlash.half_gap, c0 = gaident_clip(x0, gap), c1 = gaident_clip(x1, gap), step = x1 - x0;
    const double b0 = x0 - c0, b1 = x1 - c1, S = c1 * (x1 - 0.5 * c1) - c0 * (x0 - 0.5 * c0);
    const int moves = fabs(step) > 1e-6 * gap;
    const double spring = moves ? S / step : 0.5 * (c0 + c1);
    const double share = moves ? (c1 - c0) / step : gap > fabs(x0) ? 1.0 : 0.0;
    return -(k->stiffness * spring + k->damping * dx * share) +
           0.5 * k->hardening_stiffness.cubic * (b0 * b0 * b0 + b1 * b1 * b1);
}

/* -- the mechanism over one substep under the torque T -------------------------------------------------------------------- */

static void gaident_observer(const gaident_drive *k, gaident_memory *s, double T, double t) {
    const int n = k->order;
    const double w = s->x[0], w_free = (w + (n > 1 ? s->x[1] : 0.0) + k->b[1] * T) - k->a[0] * w;
    double w_next = w_free;
    int i;
    if (k->at_motor.effects & GAIDENT_DRY) {
        w_next = gaident_dry(&k->at_motor, &s->at_motor, k->h, w, w_free, k->b[1], t);
        T -= (w_free - w_next) / k->b[1];
    }
    for (i = 1; i + 1 < n; ++i) s->x[i] = (s->x[i] + s->x[i + 1] + k->b[i + 1] * T) - k->a[i] * w;
    if (n > 1) s->x[n - 1] = (s->x[n - 1] + k->b[n] * T) - k->a[n - 1] * w;
    s->x[0] = w_next;
}

/* Both ends of the shaft under friction: each mass sticks or slips. The load's equation is solved with what the motor does, which
   is found with the load's friction of the round before; the rounds converge to rounding error. */
static void gaident_both_dry(const gaident_drive *k, gaident_memory *s, double w_free, double w_free_load, double t, double *w_next,
                             double *w_next_load) {
    const double across = k->motor[0] + k->coupling[0], back = k->motor[1], beta = k->motor[0], beta_load = k->motor[1] + k->coupling[1];
    const gaident_shaft_memory motor = s->at_motor, load = s->at_load;
    double f = 0.0, f_load = load.friction;
    int round;
    for (round = 0; round < 2; ++round) {
        double free = w_free - across * f_load, b = beta_load;
        s->at_motor = motor;
        s->at_load = load;
        *w_next = gaident_dry(&k->at_motor, &s->at_motor, k->h, s->x[0], free, beta, t);
        f = (free - *w_next) / beta;
        free = w_free_load - back * f;
        if (*w_next == 0.0) {
            free = w_free_load - back / beta * w_free;
            b -= back / beta * across;
        }
        *w_next_load = gaident_dry(&k->at_load, &s->at_load, k->h, s->x[1], free, b, t);
        f_load = (free - *w_next_load) / b;
    }
    s->at_motor.friction = (w_free - across * f_load - *w_next) / beta;
    s->at_load.friction = f_load;
}

static void gaident_masses(const gaident_drive *k, gaident_memory *s, double T, double t) {
    const double x0 = s->x[2] * k->per_scale, dx0 = s->x[0] - s->x[1];
    double free[3], end[3], load[3], T_load, now, mean, w_next, w_next_load;
    int i;
    for (i = 0; i < 3; ++i) load[i] = k->motor[i] + k->coupling[i];
    s->at_load.braking = gaident_braking(&k->at_load, s->angle + 0.5 * k->h * s->x[1] - x0);
    T_load = -s->at_load.braking;
    for (i = 0; i < 3; ++i) {
        free[i] = s->x[i] + k->phi[3 * i] * s->x[0] + k->phi[3 * i + 1] * s->x[1] + k->phi[3 * i + 2] * s->x[2];
        free[i] += k->motor[i] * T + load[i] * T_load;
        end[i] = free[i] - k->motor[i] * s->at_motor.friction - load[i] * s->at_load.friction;
    }
    now = gaident_correction(k, x0, dx0);
    mean = gaident_mean_correction(k, x0, (end[2] + k->coupling[2] * now) * k->per_scale,
                                   0.5 * (dx0 + (end[0] - end[1]) + (k->coupling[0] - k->coupling[1]) * now));
    for (i = 0; i < 3; ++i) free[i] += k->coupling[i] * mean;
    w_next = free[0];
    w_next_load = free[1];
    if ((k->at_motor.effects & GAIDENT_DRY) && (k->at_load.effects & GAIDENT_DRY)) {
        gaident_both_dry(k, s, free[0], free[1], t, &w_next, &w_next_load);
    } else if (k->at_load.effects & GAIDENT_DRY) {
        w_next_load = gaident_dry(&k->at_load, &s->at_load, k->h, s->x[1], free[1], load[1], t);
        s->at_load.friction = (free[1] - w_next_load) / load[1];
        w_next -= load[0] * s->at_load.friction;
    } else if (k->at_motor.effects & GAIDENT_DRY) {
        w_next = gaident_dry(&k->at_motor, &s->at_motor, k->h, s->x[0], free[0], k->motor[0], t);
        s->at_motor.friction = (free[0] - w_next) / k->motor[0];
        w_next_load -= k->motor[1] * s->at_motor.friction;
    }
    s->x[0] = w_next;
    s->x[1] = w_next_load;
    s->x[2] = free[2] - k->motor[2] * s->at_motor.friction - load[2] * s->at_load.friction;
}

/* -- the loop ------------------------------------------------------------------------------------------------------------- */

static double gaident_measured(const gaident_drive *k, const gaident_memory *s) {
    if (!(k->effects & GAIDENT_VELOCITY_RIPPLE)) return s->x[0];
    return s->x[0] * (1.0 + k->velocity_ripple.amplitude * k->velocity_ripple.order *
                                cos(k->velocity_ripple.order * s->angle + k->velocity_ripple.phase));
}

/* A linear drive: the velocity answers within the sample where b[0] is not 0, so that the loop is solved, then limited. */
static double gaident_linear_step(const gaident_drive *k, gaident_memory *s, double input, double *torque) {
    double u = input, y;
    int i;
    if (k->closed) {
        const double lead = input - s->x[0], b0 = k->b[0];
        const double unlimited = (lead - b0 * s->stored) / (1.0 + b0 * (k->kp + k->g));
        const double I = gaident_clip(s->stored + k->g * unlimited, k->integrator_limit);
        double e;
        u = gaident_clip(k->kp * (lead - b0 * I) / (1.0 + b0 * k->kp) + I, k->torque_limit);
        e = input - (s->x[0] + b0 * u);
        s->stored = gaident_clip(s->stored + k->g * e, k->integrator_limit) + k->g * e;
    }
    y = s->x[0] + k->b[0] * u;
    for (i = 0; i + 1 < k->order; ++i) s->x[i] += s->x[i + 1] + k->b[i + 1] * u - k->a[i] * y;
    if (k->order > 0) s->x[k->order - 1] += k->b[k->order] * u - k->a[k->order - 1] * y;
    *torque = u;
    return y;
}

/* A drive with effects: velocity read, torque issued, then the substeps. `issued`: torques on their way. */
static double gaident_effects_step(const gaident_drive *k, gaident_memory *s, double *issued, double input, double *torque) {
    double y = k->effects & GAIDENT_VELOCITY_FILTER ? s->velocity_filter.output : gaident_measured(k, s), u = input;
    int j;
    if (k->effects & GAIDENT_VELOCITY_QUANTISATION) y = nearbyint(y / k->velocity_quantisation.step) * k->velocity_quantisation.step;
    if (k->closed) {
        double r = input, e, I, limit = k->integrator_limit;
        if (k->effects & GAIDENT_COMMAND_RATE_LIMIT)
            r = s->command_rate_limit.before += gaident_clip(r - s->command_rate_limit.before, k->command_rate_limit.step);
        if (k->effects & GAIDENT_INTEGRATOR_CLAMP) limit = fmin(limit, k->integrator_clamp.limit);
        e = r - y;
        I = gaident_clip(s->stored + k->g * e, limit);
        s->stored = I + k->g * e;
        u = gaident_clip(k->kp * e + I, k->torque_limit);
    }
    *torque = u;
    if (k->effects & GAIDENT_TORQUE_SATURATION) u = gaident_clip(u, k->torque_saturation.limit);
    if (k->effects & GAIDENT_TORQUE_DEAD_BAND) u -= gaident_clip(u, k->torque_dead_band.width);
    if (k->effects & GAIDENT_TRANSPORT_DELAY) {
        s->newest = (s->newest + 1) % k->transport_delay.length;
        issued[s->newest] = u;
    }
    for (j = 0; j < k->substeps; ++j) {
        const double w = s->x[0];
        double T = u;
        if (k->effects & GAIDENT_TRANSPORT_DELAY) {
            const int back = k->transport_delay.back[j], length = k->transport_delay.length;
            const double old = issued[(s->newest - back + length) % length];
            const double young = issued[(s->newest - back + (back > 0) + length) % length];
            T = old + (young - old) * k->transport_delay.share[j];
        }
        if (k->effects & GAIDENT_TORQUE_LAG) {
            const double gap = s->torque_lag.T - T;
            s->torque_lag.T = T + gap * k->torque_lag.decay;
            T += gap * k->torque_lag.mean;
        }
        s->at_motor.braking = gaident_braking(&k->at_motor, s->theta);
        T -= s->at_motor.braking;
        s->theta = s->angle + 1.5 * k->h * w;
        if (k->two_masses) gaident_masses(k, s, T, s->time + 0.5 * k->h);
        else gaident_observer(k, s, T, s->time + 0.5 * k->h);
        s->time += k->h;
        s->angle += 0.5 * k->h * (w + s->x[0]);
        if (k->effects & GAIDENT_VELOCITY_FILTER) {
            const double now = gaident_measured(k, s);
            s->velocity_filter.output = k->velocity_filter.decay * s->velocity_filter.output +
                                        k->velocity_filter.of_old * s->velocity_filter.w + k->velocity_filter.of_new * now;
            s->velocity_filter.w = now;
        }
    }
    return y;
}

static double gaident_step(const gaident_drive *k, gaident_memory *s, double *issued, double input, double *torque) {
    if (k->substeps > 0) return gaident_effects_step(k, s, issued, input, torque);
    return gaident_linear_step(k, s, input, torque);
}

#endif
