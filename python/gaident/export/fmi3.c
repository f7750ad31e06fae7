/* A gaident model as a co-simulation of FMI 3.0 (fmi-standard.org). C99.
 *
 * The file that includes this one says: FMU_TOKEN, FMU_DT [s], FMU_STATE, FMU_RESET, FMU_STEP, and FMU_ANGLE where the model has
 * an angle of its own.
 * At the time t of a sample the model has a state and an input. The outputs are what a step from there gives: a copy of the state
 * steps, so that asking changes nothing. fmi3DoStep steps the state itself, with the input held.
 */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define FMU_EXPORT __declspec(dllexport)
#else
#define FMU_EXPORT __attribute__((visibility("default")))
#endif

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef void (*fmi3LogMessageCallback)(void *environment, fmi3Status status, const char *category, const char *message);

enum { FMU_TIME, FMU_INPUT, FMU_VELOCITY, FMU_TORQUE, FMU_POSITION }; /* value references */

typedef struct {
    FMU_STATE drive;
    double start, input, angle, before; /* time of the start [s]; the input; angle of the sample before [rad], its velocity */
    uint64_t steps;
} fmu_memory;

typedef struct {
    fmu_memory now;
    void *environment;
    fmi3LogMessageCallback log;
} fmu;

typedef struct {
    double velocity, torque, angle;
} fmu_outputs;

static fmu_outputs fmu_step(fmu_memory *m) { /* the outputs at a sample; m is one further then */
    fmu_outputs at;
#ifdef FMU_ANGLE
    at.angle = FMU_ANGLE(m->drive); /* as the step before left it */
#endif
    at.velocity = FMU_STEP(&m->drive, m->input);
    at.torque = m->drive.torque;
#ifndef FMU_ANGLE
    at.angle = m->steps ? m->angle + 0.5 * FMU_DT * (at.velocity + m->before) : 0.0;
#endif
    m->angle = at.angle;
    m->before = at.velocity;
    ++m->steps;
    return at;
}

static fmi3Status fmu_says(fmu *f, const char *message) {
    if (f && f->log) f->log(f->environment, fmi3Error, "logStatusError", message);
    return fmi3Error;
}

static void fmu_begin(fmu *f, double start) {
    const double input = f->now.input;
    memset(&f->now, 0, sizeof f->now);
    f->now.start = start;
    f->now.input = input;
    FMU_RESET(&f->now.drive);
}

FMU_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

FMU_EXPORT fmi3Status fmi3SetDebugLogging(void *f, bool on, size_t n, const char *const categories[]) {
    (void)f, (void)on, (void)n, (void)categories;
    return fmi3OK;
}

FMU_EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                             bool events, bool early, const uint32_t intermediate[], size_t n, void *environment,
                                             fmi3LogMessageCallback log, void (*update)(void)) {
    fmu *f;
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early, (void)intermediate, (void)n, (void)update;
    if (!token || strcmp(token, FMU_TOKEN) != 0) {
        if (log) log(environment, fmi3Error, "logStatusError", "the instantiation token is that of another model description");
        return NULL;
    }
    f = calloc(1, sizeof *f);
    if (!f) return NULL;
    f->environment = environment;
    f->log = log;
    fmu_begin(f, 0.0);
    return f;
}

FMU_EXPORT void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                              void *environment, fmi3LogMessageCallback log) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
    return NULL;
}

FMU_EXPORT void *fmi3InstantiateScheduledExecution(const char *name, const char *token, const char *resources, bool visible,
                                                   bool logging, void *environment, fmi3LogMessageCallback log, void (*update)(void),
                                                   void (*lock)(void), void (*unlock)(void)) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)log;
    (void)update, (void)lock, (void)unlock;
    return NULL;
}

FMU_EXPORT void fmi3FreeInstance(void *f) { free(f); }

FMU_EXPORT fmi3Status fmi3EnterInitializationMode(void *f, bool tolerant, double tolerance, double start, bool stops, double stop) {
    (void)tolerant, (void)tolerance, (void)stops, (void)stop;
    fmu_begin(f, start);
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3ExitInitializationMode(void *f) { return f ? fmi3OK : fmi3Error; }
FMU_EXPORT fmi3Status fmi3EnterStepMode(void *f) { return f ? fmi3OK : fmi3Error; }
FMU_EXPORT fmi3Status fmi3EnterConfigurationMode(void *f) { return f ? fmi3OK : fmi3Error; }
FMU_EXPORT fmi3Status fmi3ExitConfigurationMode(void *f) { return f ? fmi3OK : fmi3Error; }
FMU_EXPORT fmi3Status fmi3Terminate(void *f) { return f ? fmi3OK : fmi3Error; }

FMU_EXPORT fmi3Status fmi3Reset(void *f) {
    ((fmu *)f)->now.input = 0.0;
    fmu_begin(f, 0.0);
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3GetFloat64(void *f, const uint32_t references[], size_t n, double values[], size_t count) {
    fmu_memory copy;
    fmu_outputs at;
    size_t i;
    if (n != count) return fmu_says(f, "every variable is one number");
    copy = ((fmu *)f)->now;
    at = fmu_step(&copy);
    for (i = 0; i < n; ++i) {
        switch (references[i]) {
        case FMU_TIME: values[i] = copy.start + FMU_DT * (double)(copy.steps - 1); break;
        case FMU_INPUT: values[i] = copy.input; break;
        case FMU_VELOCITY: values[i] = at.velocity; break;
        case FMU_TORQUE: values[i] = at.torque; break;
        case FMU_POSITION: values[i] = at.angle; break;
        default: return fmu_says(f, "there is no such variable to get");
        }
    }
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SetFloat64(void *f, const uint32_t references[], size_t n, const double values[], size_t count) {
    size_t i;
    if (n != count) return fmu_says(f, "every variable is one number");
    for (i = 0; i < n; ++i) {
        if (references[i] != FMU_INPUT) return fmu_says(f, "the input alone can be set");
        ((fmu *)f)->now.input = values[i];
    }
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3DoStep(void *f, double at, double size, bool no_rollback, bool *event, bool *terminate, bool *early,
                                 double *last) {
    fmu_memory *m = &((fmu *)f)->now;
    const double wanted = size / FMU_DT, whole = floor(wanted + 0.5);
    double left;
    (void)at, (void)no_rollback;
    *event = *terminate = *early = false;
    if (!(whole >= 1.0) || fabs(wanted - whole) > 1e-6 * whole) {
        *last = m->start + FMU_DT * (double)m->steps;
        return fmu_says(f, "the communication step has to be a whole multiple of fixedInternalStepSize");
    }
    for (left = whole; left > 0.0; left -= 1.0) fmu_step(m);
    *last = m->start + FMU_DT * (double)m->steps;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3GetFMUState(void *f, void **state) {
    if (!*state) *state = malloc(sizeof(fmu_memory));
    if (!*state) return fmu_says(f, "no memory is left");
    memcpy(*state, &((fmu *)f)->now, sizeof(fmu_memory));
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SetFMUState(void *f, void *state) {
    memcpy(&((fmu *)f)->now, state, sizeof(fmu_memory));
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3FreeFMUState(void *f, void **state) {
    (void)f;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SerializedFMUStateSize(void *f, void *state, size_t *size) {
    (void)f, (void)state;
    *size = sizeof(fmu_memory);
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3SerializeFMUState(void *f, void *state, uint8_t bytes[], size_t size) {
    if (size < sizeof(fmu_memory)) return fmu_says(f, "the serialized state is larger");
    memcpy(bytes, state, sizeof(fmu_memory));
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3DeserializeFMUState(void *f, const uint8_t bytes[], size_t size, void **state) {
    if (size != sizeof(fmu_memory)) return fmu_says(f, "the serialized state is that of another model");
    if (!*state) *state = malloc(sizeof(fmu_memory));
    if (!*state) return fmu_says(f, "no memory is left");
    memcpy(*state, bytes, sizeof(fmu_memory));
    return fmi3OK;
}

/* -- what the standard wants to be there and this model has not: no variable of another type, no clock, no event ------------ */

#define FMU_NO_TYPE(Type, type)                                                                                                  \
    FMU_EXPORT fmi3Status fmi3Get##Type(void *f, const uint32_t r[], size_t n, type v[], size_t count) {                         \
        (void)r, (void)v, (void)count;                                                                                           \
        return n ? fmu_says(f, "there is no variable of the type " #Type) : fmi3OK;                                              \
    }                                                                                                                            \
    FMU_EXPORT fmi3Status fmi3Set##Type(void *f, const uint32_t r[], size_t n, const type v[], size_t count) {                   \
        (void)r, (void)v, (void)count;                                                                                           \
        return n ? fmu_says(f, "there is no variable of the type " #Type) : fmi3OK;                                              \
    }
FMU_NO_TYPE(Float32, float)
FMU_NO_TYPE(Int8, int8_t)
FMU_NO_TYPE(UInt8, uint8_t)
FMU_NO_TYPE(Int16, int16_t)
FMU_NO_TYPE(UInt16, uint16_t)
FMU_NO_TYPE(Int32, int32_t)
FMU_NO_TYPE(UInt32, uint32_t)
FMU_NO_TYPE(Int64, int64_t)
FMU_NO_TYPE(UInt64, uint64_t)
FMU_NO_TYPE(Boolean, bool)
typedef const char *fmu_text;
FMU_NO_TYPE(String, fmu_text)

#define FMU_NOT(name, ...)                                                                                                       \
    FMU_EXPORT fmi3Status name(void *f, __VA_ARGS__) { return fmu_says(f, #name " is not supported"); }
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
FMU_NOT(fmi3GetBinary, const uint32_t r[], size_t n, size_t sizes[], const uint8_t *v[], size_t count)
FMU_NOT(fmi3SetBinary, const uint32_t r[], size_t n, const size_t sizes[], const uint8_t *const v[], size_t count)
FMU_NOT(fmi3GetClock, const uint32_t r[], size_t n, bool v[])
FMU_NOT(fmi3SetClock, const uint32_t r[], size_t n, const bool v[])
FMU_NOT(fmi3GetNumberOfVariableDependencies, uint32_t r, size_t *n)
FMU_NOT(fmi3GetVariableDependencies, uint32_t r, size_t of[], uint32_t on[], size_t of_them[], int kinds[], size_t n)
FMU_NOT(fmi3GetDirectionalDerivative, const uint32_t u[], size_t nu, const uint32_t k[], size_t nk, const double seed[], size_t ns,
        double found[], size_t n)
FMU_NOT(fmi3GetAdjointDerivative, const uint32_t u[], size_t nu, const uint32_t k[], size_t nk, const double seed[], size_t ns,
        double found[], size_t n)
FMU_NOT(fmi3GetIntervalDecimal, const uint32_t r[], size_t n, double v[], int qualifiers[])
FMU_NOT(fmi3GetIntervalFraction, const uint32_t r[], size_t n, uint64_t v[], uint64_t of[], int qualifiers[])
FMU_NOT(fmi3GetShiftDecimal, const uint32_t r[], size_t n, double v[])
FMU_NOT(fmi3GetShiftFraction, const uint32_t r[], size_t n, uint64_t v[], uint64_t of[])
FMU_NOT(fmi3SetIntervalDecimal, const uint32_t r[], size_t n, const double v[])
FMU_NOT(fmi3SetIntervalFraction, const uint32_t r[], size_t n, const uint64_t v[], const uint64_t of[])
FMU_NOT(fmi3SetShiftDecimal, const uint32_t r[], size_t n, const double v[])
FMU_NOT(fmi3SetShiftFraction, const uint32_t r[], size_t n, const uint64_t v[], const uint64_t of[])
FMU_NOT(fmi3UpdateDiscreteStates, bool *update, bool *end, bool *nominals, bool *values, bool *defined, double *next)
FMU_NOT(fmi3CompletedIntegratorStep, bool no_rollback, bool *event, bool *end)
FMU_NOT(fmi3SetTime, double time)
FMU_NOT(fmi3SetContinuousStates, const double v[], size_t n)
FMU_NOT(fmi3GetContinuousStateDerivatives, double v[], size_t n)
FMU_NOT(fmi3GetEventIndicators, double v[], size_t n)
FMU_NOT(fmi3GetContinuousStates, double v[], size_t n)
FMU_NOT(fmi3GetNominalsOfContinuousStates, double v[], size_t n)
FMU_NOT(fmi3GetNumberOfEventIndicators, size_t *n)
FMU_NOT(fmi3GetNumberOfContinuousStates, size_t *n)
FMU_NOT(fmi3GetOutputDerivatives, const uint32_t r[], size_t n, const int32_t orders[], double v[], size_t count)
FMU_NOT(fmi3ActivateModelPartition, uint32_t clock, double time)

FMU_EXPORT fmi3Status fmi3EnterEventMode(void *f) { return fmu_says(f, "fmi3EnterEventMode is not supported"); }
FMU_EXPORT fmi3Status fmi3EvaluateDiscreteStates(void *f) { return fmu_says(f, "fmi3EvaluateDiscreteStates is not supported"); }
FMU_EXPORT fmi3Status fmi3EnterContinuousTimeMode(void *f) { return fmu_says(f, "fmi3EnterContinuousTimeMode is not supported"); }
