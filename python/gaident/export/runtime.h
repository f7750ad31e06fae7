/* The gaident runtime: what a drive and its loop are, and what they remember. C99.
 *
 * Effects have the coefficients that the simulation uses (csrc/gaident/effects, one header each), in the same order.
 */
#ifndef GAIDENT_RUNTIME_DECLARED
#define GAIDENT_RUNTIME_DECLARED

enum { GAIDENT_ORDER = 14 };       /* of a mechanism, at most */
enum { GAIDENT_DIFFERENCES = 16 }; /* samples over which the angle is subtracted, at most */
enum { GAIDENT_FILTERS = 8 };      /* of a controller, one behind the other, at most */

enum { GAIDENT_WAVES = 4 };        /* of an effect of the angle that has several, at most */

enum { GAIDENT_NO_ANTI_WINDUP, GAIDENT_HOLD, GAIDENT_TRACKING };

enum { /* the effects that act */
    GAIDENT_COULOMB_FRICTION = 1 << 0,
    GAIDENT_STRIBECK_FRICTION = 1 << 1,
    GAIDENT_ASYMMETRIC_FRICTION = 1 << 2,
    GAIDENT_PRESLIDING_FRICTION = 1 << 3,
    GAIDENT_QUADRATIC_DRAG = 1 << 4,
    GAIDENT_LOAD_TORQUE = 1 << 5,
    GAIDENT_UNBALANCE = 1 << 6,
    GAIDENT_COGGING = 1 << 7,
    GAIDENT_FRICTION_DRIFT = 1 << 8,
    GAIDENT_BACKLASH = 1 << 9,
    GAIDENT_HARDENING_STIFFNESS = 1 << 10,
    GAIDENT_TORQUE_SATURATION = 1 << 11,
    GAIDENT_TORQUE_DEAD_BAND = 1 << 12,
    GAIDENT_TRANSPORT_DELAY = 1 << 13,
    GAIDENT_TORQUE_LAG = 1 << 14,
    GAIDENT_INTEGRATOR_CLAMP = 1 << 15,
    GAIDENT_COMMAND_RATE_LIMIT = 1 << 16,
    GAIDENT_VELOCITY_FILTER = 1 << 17,
    GAIDENT_VELOCITY_RIPPLE = 1 << 18,
    GAIDENT_VELOCITY_QUANTISATION = 1 << 19,
    GAIDENT_LUGRE_FRICTION = 1 << 20,
    GAIDENT_LOAD_DEPENDENT_FRICTION = 1 << 21,
    GAIDENT_SQUARE_ROOT_DRAG = 1 << 22,
    GAIDENT_POSITION_FRICTION = 1 << 23,
    GAIDENT_HYSTERETIC_COUPLING = 1 << 24,
    GAIDENT_TORQUE_HUM = 1 << 25,
    GAIDENT_POSITION_INERTIA = 1 << 26,
    GAIDENT_VELOCITY_DIFFERENCE = 1 << 27,
    GAIDENT_VELOCITY_OBSERVER = 1 << 28,
    GAIDENT_COGGING_WAVES = 1 << 29, /* several waves, in the place of one */
    GAIDENT_VELOCITY_RIPPLE_WAVES = 1 << 30,
    GAIDENT_DRY = GAIDENT_COULOMB_FRICTION | GAIDENT_STRIBECK_FRICTION | GAIDENT_ASYMMETRIC_FRICTION |
                  GAIDENT_PRESLIDING_FRICTION | GAIDENT_LUGRE_FRICTION | GAIDENT_QUADRATIC_DRAG |
                  GAIDENT_FRICTION_DRIFT | GAIDENT_LOAD_DEPENDENT_FRICTION | GAIDENT_SQUARE_ROOT_DRAG |
                  GAIDENT_POSITION_FRICTION
};

typedef struct { /* what acts at one end of the shaft */
    long effects;
    struct { double torque; } coulomb_friction;
    struct { double torque, static_torque, slowness; } stribeck_friction;
    struct { double torque_positive, torque_negative, viscous_positive, viscous_negative; } asymmetric_friction;
    struct { double stiffness, per_break, limit; } presliding_friction;
    struct { double torque, static_torque, slowness, stiffness, damping, damping_per_step, limit; } lugre_friction;
    struct { double coefficient; } quadratic_drag;
    struct { double coefficient; } square_root_drag;
    struct { double load; } load_torque;
    struct { double amplitude, phase; } unbalance;
    struct { double amplitude, order, phase; } cogging, cogging_waves[GAIDENT_WAVES];
    struct { double torque, rate; } friction_drift;
    struct { double torque, share; } load_dependent_friction;
    struct { double torque, change, order, phase; } position_friction;
    struct { double mean, turns, phase; } torque_hum;
} gaident_shaft;

typedef struct { /* y(n) = b0 u(n) + b1 u(n-1) + b2 u(n-2) - a1 y(n-1) - a2 y(n-2), one behind the other */
    int count;
    struct { double b0, b1, b2, a1, a2; } filter[GAIDENT_FILTERS];
} gaident_filters;

typedef struct { /* what a controller has beyond a bare PI, at its own clock T */
    int samples;            /* of the controller in a step */
    double before;          /* integral gain times T times the share of the error before, as g of the newest [N m s/rad] */
    double command_weight;  /* of the command in the proportional part */
    int anti_windup;
    double tracking;        /* T over the tracking time */
    gaident_filters command_filters, velocity_filters, torque_filters;
    double position_gain;   /* 1/s; 0: no position controller, and the input is a velocity command [rad/s], else one of position [rad] */
    int position_every;     /* samples from one of the position controller's to the next */
    int feeds, past;        /* whether there is a feedforward, and whether its slopes are those over the past period */
    double slope_time;      /* that period [s] */
    double velocity_feedforward, acceleration_feedforward, friction_feedforward; /* 1, N m s^2/rad, N m */
} gaident_servo;

typedef struct {
    const gaident_servo *servo;            /* 0: the controller is a bare PI, or there is none */
    int closed;                            /* whether there is a controller: the input is a command [rad/s], else a torque [N m] */
    double kp, g;                          /* proportional gain, integral gain times dt/2 [N m s/rad] */
    double torque_limit, integrator_limit; /* N m */
    int order;                             /* of the mechanism */
    double a[GAIDENT_ORDER], b[GAIDENT_ORDER + 1]; /* its denominator and numerator in delta = z - 1, at the substep */
    int substeps;                          /* of a sample; 0: the mechanism is linear and no effect acts */
    double h;                              /* substep [s] */
    int two_masses;                        /* with a nonlinear coupling, or effects at the load: in place of a and b */
    double phi[9];                         /* e^(A h) - 1 over motor velocity, load velocity, twist to scale */
    double motor[3], coupling[3];          /* response to 1 N m at the motor, to 1 N m more in the coupling */
    double rise[GAIDENT_ORDER];            /* as much as a torque that rises by 1 N m do: a torque, and more of x[1], x[2], ... */
    double bend[GAIDENT_ORDER], bend_of[3]; /* of the mean velocity beside that of its ends: state before; x[0], x[1] behind; rise */
    double stiffness, damping, per_scale;  /* of the coupling [N m/rad], [N m s/rad]; twist per scaled twist */

    gaident_shaft at_motor, at_load;
    long effects; /* the others */
    struct { double change, bend, order, phase; } position_inertia; /* of the load of two masses, else of all */
    struct { double half_gap; } backlash;
    struct { double cubic; } hardening_stiffness;
    struct { double stiffness, per_break; } hysteretic_coupling;
    struct { double limit; } torque_saturation;
    struct { double width; } torque_dead_band;
    struct { int length; const int *back; const double *share; } transport_delay; /* torques kept; per substep */
    struct { double decay, mean, rise, decay_of_rise, mean_of_rise, rise_of_rise; } torque_lag;
    struct { double limit; } integrator_clamp;
    struct { double step; } command_rate_limit;
    struct { double samples, per_samples, step, last; } velocity_difference;
    struct { double of_y, of_v, of_step, of_bend, slope_of_y, slope_of_v, slope_of_step, slope_of_bend, lag; } velocity_observer;
    struct { double decay, of_old, of_new, of_bend, lag; } velocity_filter;
    struct { double amplitude, order, phase; } velocity_ripple, velocity_ripple_waves[GAIDENT_WAVES];
    struct { double step; } velocity_quantisation;
} gaident_drive;

typedef struct {
    double x1[GAIDENT_FILTERS], x2[GAIDENT_FILTERS];
} gaident_filters_memory;

typedef struct {
    double integral;                        /* N m */
    gaident_filters_memory command, velocity, torque;
    double asked, fed;                      /* velocity command before its filters [rad/s]; torque that is fed forward [N m] */
    int until;                              /* samples until the position controller's next one */
    int begun;
    double command_before, velocity_before; /* of the period before, where slopes are those over the past one */
} gaident_servo_memory;

typedef struct {
    double z, other;           /* deflection [rad], the other friction's torque one substep ago [N m] */
    double theta, e, one_plus; /* of the substep being solved */
} gaident_bristle;

typedef struct {
    double friction; /* of the substep before [N m] */
    double braking;  /* what the torques there brake with in this one [N m] */
    double theta;    /* the angle there in its middle [rad] */
    struct { double w_before; } stribeck_friction;
    gaident_bristle presliding_friction;
    struct { gaident_bristle bristle; double w_before; } lugre_friction;
} gaident_shaft_memory;

typedef struct {
    double x[GAIDENT_ORDER]; /* the mechanism */
    double stored;           /* of the controller [N m] */
    double angle, theta;     /* of the motor; in the middle of the substep, foreseen [rad] */
    double late[2];          /* of x[1], x[2] at the substep's start, what a rise of the torque makes of them */
    double time;             /* s */
    int newest;              /* of the torques on their way */
    gaident_shaft_memory at_motor, at_load;
    struct { double z, x; } hysteretic_coupling; /* deflection, and the twist to which it belongs [rad] */
    struct { double T; } torque_lag;
    struct { double before; } command_rate_limit;
    struct { double output, mean[GAIDENT_DIFFERENCES], sum, w, steps; } velocity_difference;
    struct { double output, slope, w; } velocity_observer;
    struct { double output, w; } velocity_filter;
} gaident_memory;

#endif
