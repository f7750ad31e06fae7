/* gaident in a drive: identification of the plant inside a velocity loop, while the drive works. C99.
 *
 *     static uint64_t memory[...];                             gaident_bytes() bytes, aligned to 8
 *     gaident_loop loop = {.controller = {.kp = ..., .ki = ...}, .sample_time = ..., .peak = ...};
 *     gaident_settings settings = gaident_paper_settings(loop);
 *     gaident_search *g = gaident_configure(memory, sizeof memory, &settings);
 *     in the control task:      gaident_feed(g, command, velocity);    until it returns 0: the record is full
 *     in a background task:     gaident_run(g, 1);                     one generation more; or gaident_work(g, n) for shorter slices
 *     at any time there:        gaident_best(g, &model);
 *
 * gaident_feed and the others may be called from different tasks, where feed is in the one of higher priority on the same processor: feed
 * touches nothing but the record, and the search begins when the record is full. `g` is never NULL. No function allocates, waits,
 * or prints. Numbers are double in the interface whatever the arithmetic inside. */
#ifndef GAIDENT_H
#define GAIDENT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of this interface: 10000 major + 100 minor + patch of gaident's version. An object of another major or, below 1.0, minor version may
 * have other structures: compare it with gaident_version() once, when the drive starts. */
#define GAIDENT_H_VERSION 200

typedef struct gaident_search gaident_search;

/* The velocity controller, a PI: T = kp e + ki integral of e dt, e = command - velocity. */
typedef struct {
    double kp; /* proportional gain [N m s/rad] */
    double ki; /* integral gain [N m/rad] */
} gaident_controller;

/* The loop that is recorded. */
typedef struct {
    gaident_controller controller;
    double sample_time; /* [s] */
    double peak;        /* largest velocity or command to be expected [rad/s]; sets the fixed-point scaling */
} gaident_loop;

typedef struct {
    gaident_loop loop;
    uint64_t seed;       /* the same seed gives the same run, here and on the host */
    double crossover;    /* rate per pair, 0..1; the paper: 0.9 */
    double mutation;     /* rate per bit, 1e-6..1; the paper: 0.01 */
    int tournament;      /* contestants; the paper does not say, 2 */
    double error_weight; /* Wf1 */
    double order_weight; /* Wf2 */
} gaident_settings;

/* s^2 + e1 s + e0 [1/s, 1/s^2] */
typedef struct {
    double e1, e0;
} gaident_pair;

/* G(s) = gain * prod zeros / prod poles, p poles more than zeros, q zeros: (p+q)/2 pairs of poles and, if p+q is odd, s + pole; q/2 pairs
 * of zeros and, if q is odd, s + zero. */
typedef struct {
    int p, q;
    double gain;
    gaident_pair pole_pairs[3];
    double pole;
    gaident_pair zero_pairs[1];
    double zero;
    double fitness;  /* equation (6); smaller is better */
    int generation;  /* in which it was found */
    int generations; /* evaluated so far */
} gaident_model;

/* The paper's settings (Table II) for a loop. */
gaident_settings gaident_paper_settings(gaident_loop loop);

/* GAIDENT_H_VERSION as the object was compiled with it. */
int gaident_version(void);

/* Memory that a search takes [bytes]. */
size_t gaident_bytes(void);

/* Builds a search in `memory`, which stays the caller's. NULL where it is too small or not aligned to 8, or a setting is out of range. */
gaident_search* gaident_configure(void* memory, size_t bytes, const gaident_settings* settings);

/* One sample of the step that is to be identified, from rest on [rad/s]. 1: taken; 0: the record was already full. A sample that
 * is not finite or beyond 2 peak is taken, too, but spoils the record: gaident_ready says so. */
int gaident_feed(gaident_search* g, double command, double velocity);

/* 0: the record is not full; 1: it is; -1: it is, but spoiled, and no model will come of it: configure anew. */
int gaident_ready(const gaident_search* g);

/* Runs `generations` more; returns how many have been evaluated in all. 0 while the record is not full. */
int gaident_run(gaident_search* g, int generations);

/* A shorter slice: up to `individuals` evaluated, or one population bred. Returns the generations evaluated in all. */
int gaident_work(gaident_search* g, int individuals);

/* The best model so far; 1, or 0 while there is none: no candidate's fitness was finite, or the record is spoiled. */
int gaident_best(const gaident_search* g, gaident_model* model);

#ifdef __cplusplus
}
#endif

#endif
