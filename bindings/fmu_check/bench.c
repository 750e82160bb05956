/* Nanoseconds of a step of an unpacked FMU, inputs set and forces read in each:
 *   bench UNIT.so TOKEN RESOURCES < path (depth, slide x, slide y, spin; increments)
 * Prints `call ns` lines: the least of twenty rounds, for each step of the model, of which a step of the FMU has one or more. */
#define _POSIX_C_SOURCE 200112L
#include "fmi3Functions.h"
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define LONGEST 100000
#define ROUNDS 20
#define INPUTS 4
#define OUTPUTS 7

static double places[LONGEST][INPUTS];

static double now_ns(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

/* A function of the unit. POSIX has it that a pointer to data becomes one to a function. */
static void find(void *unit, const char *name, void *function)
{
    void *const found = dlsym(unit, name);
    if (found == NULL) {
        (void)fprintf(stderr, "no %s\n", name);
        exit(2);
    }
    (void)memcpy(function, &found, sizeof found);
}

int main(int argc, char **argv)
{
    static const fmi3ValueReference inputs[INPUTS] = {1, 2, 3, 4}, outputs[OUTPUTS] = {41, 42, 43, 44, 45, 46, 47};
    static const fmi3ValueReference substeps = 63;
    fmi3InstantiateCoSimulationTYPE *instantiate;
    fmi3EnterInitializationModeTYPE *enter;
    fmi3ExitInitializationModeTYPE *leave;
    fmi3SetFloat64TYPE *set;
    fmi3GetFloat64TYPE *get;
    fmi3GetInt32TYPE *get_integer;
    fmi3DoStepTYPE *step;
    fmi3FreeInstanceTYPE *release;
    double least = 1e30, forces[OUTPUTS], increment[INPUTS];
    size_t steps = 0, i;
    long model_steps = 0;
    int round;
    void *const unit = argc == 4 ? dlopen(argv[1], RTLD_NOW | RTLD_LOCAL) : NULL;
    if (unit == NULL) {
        (void)fprintf(stderr, "usage: bench UNIT.so TOKEN RESOURCES\n");
        return 2;
    }
    find(unit, "fmi3InstantiateCoSimulation", &instantiate);
    find(unit, "fmi3EnterInitializationMode", &enter);
    find(unit, "fmi3ExitInitializationMode", &leave);
    find(unit, "fmi3SetFloat64", &set);
    find(unit, "fmi3GetFloat64", &get);
    find(unit, "fmi3GetInt32", &get_integer);
    find(unit, "fmi3DoStep", &step);
    find(unit, "fmi3FreeInstance", &release);
    while (steps < LONGEST
           && scanf("%lf %lf %lf %lf", &increment[0], &increment[1], &increment[2], &increment[3]) == INPUTS) {
        places[steps][0] = increment[0];
        for (i = 1; i < INPUTS; i++) {
            places[steps][i] = increment[i] + (steps > 0 ? places[steps - 1][i] : 0.0);
        }
        steps++;
    }
    /* The first round counts the model's steps. */
    for (round = 0; round <= ROUNDS; round++) {
        const fmi3Instance finger = instantiate("finger", argv[2], argv[3], fmi3False, fmi3False, fmi3False, fmi3False,
                                                NULL, 0, NULL, NULL, NULL);
        fmi3Boolean event, end, early;
        fmi3Float64 last, start, took;
        fmi3Int32 count;
        if (finger == NULL || enter(finger, fmi3False, 0.0, 0.0, fmi3False, 0.0) != fmi3OK || leave(finger) != fmi3OK) {
            (void)fprintf(stderr, "the unit does not start\n");
            return 2;
        }
        start = now_ns();
        for (i = 0; i < steps; i++) {
            if (set(finger, inputs, INPUTS, places[i], INPUTS) != fmi3OK
                || step(finger, (double)i * 1e-3, 1e-3, fmi3True, &event, &end, &early, &last) != fmi3OK
                || get(finger, outputs, OUTPUTS, forces, OUTPUTS) != fmi3OK) {
                return 2;
            }
            if (round == 0) {
                if (get_integer(finger, &substeps, 1, &count, 1) != fmi3OK) {
                    return 2;
                }
                model_steps += count;
            }
        }
        took = now_ns() - start;
        least = round > 0 && took < least ? took : least;
        release(finger);
    }
    (void)printf("spin_step %.2f\n", least / (double)model_steps);
    return 0;
}
