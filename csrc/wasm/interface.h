/* The identification of one record as C functions, for a caller that shares its memory with the core and nothing else:
 * JavaScript beside WebAssembly.
 * What surrounds the core's search in Python (the choice of the structure, deviations, tests) is the caller's here too.
 *
 * A session is a record in its loop, and the fits that were made to it, numbered from 0.
 * Every function but gaident_message and gaident_close returns a negative number where something is wrong, or null.
 * gaident_message then says what.
 * One session at a time may search. */
#ifndef GAIDENT_INTERFACE_H
#define GAIDENT_INTERFACE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct gaident_session gaident_session;

enum gaident_loop { gaident_open_loop, gaident_sampled_loop, gaident_continuous_loop };

/* input: n numbers, the torque [N m] of the open loop, else the velocity command [rad/s].
 * output: n numbers, the velocity [rad/s]. Both are copied.
 * sample_time [s]. moving: 0 where the record starts at rest, 1 where its state is estimated, near the velocity velocity0 [rad/s].
 * controller: kp [N m s/rad], ki [N m/rad], largest torque, largest integral part [N m]; of no meaning in the open loop. */
gaident_session* gaident_open(const double* input, const double* output, int n, double sample_time, int moving, double velocity0,
                              enum gaident_loop loop, const double controller[4]);
void gaident_close(gaident_session* session);
const char* gaident_message(void);

/* ranges: lowest and highest gain, real part, imaginary part [rad/s], p, q, then bits a number and the scale of the gain. */
enum { gaident_range_numbers = 12 };
int gaident_set_ranges(gaident_session* session, const double ranges[gaident_range_numbers]);

/* One trial of the search by species in double arithmetic.
 * settings: population, tournament, crossover, mutation, generations, round, quiet rounds, Gray code (0 or 1), logarithmic scale
 * (0 or 1), weight of the error, weight of the order.
 * Its fits, one for each structure, are the next ones of the session; how many is returned. */
enum { gaident_setting_numbers = 11 };
int gaident_search(gaident_session* session, const double settings[gaident_setting_numbers], uint32_t seed);

/* A fit that starts from a gain, poles and zeros (real and imaginary part of each, roots of the transfer function) and start states
 * (`states` numbers; none: at rest or in steady motion). Its number is returned. `iterations` 0: no step, only its cost. */
int gaident_fit(gaident_session* session, double gain, const double* poles, int n_poles, const double* zeros, int n_zeros,
                const double* starts, int states, int iterations, double tolerance);
/* A fit that goes on from another one, its errors filtered by 1 - sum phi_i z^-i; its number is returned. */
int gaident_go_on(gaident_session* session, int fit, const double* phi, int n_phi, int iterations, double tolerance);

/* Writes p, q, gain, cost, number of start states; then real and imaginary part of each pole, and of each zero; the start states;
 * for each parameter (gain, pairs of poles, single pole, pairs of zeros, single zero) whether it stands at an end of its range.
 * Returns how many numbers. */
enum { gaident_fit_numbers = 128 };
int gaident_read_fit(gaident_session* session, int fit, double out[gaident_fit_numbers]);

/* Of the errors e of a fit: sums of e(n) e(n+k), k = 0..lags, then the largest velocity of the model. */
int gaident_residual_sums(gaident_session* session, int fit, int lags, double* out);
/* J'J, J'SJ and X'X (estimation/statistics.hpp), one after the other; the number of unknowns is returned.
 * room: how many numbers `out` takes. */
int gaident_fit_sums(gaident_session* session, int fit, const double* phi, int n_phi, const int* lags, int n_lags,
                     double threshold, double* out, int room);
/* Velocity and torque of a fit over the session's input: n numbers each. */
int gaident_simulate(gaident_session* session, int fit, double* velocity, double* torque);

#ifdef __cplusplus
}
#endif

#endif
