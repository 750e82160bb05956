/* Nanoseconds of a step over a path that is read: bench MODEL.fpm < path (four columns: depth, slide x, slide y, spin).
 * Prints `call ns` lines: the least of twenty rounds. */
#define _POSIX_C_SOURCE 199309L
#include "common.h"
#include <time.h>

#define LONGEST 100000
#define ROUNDS 20

static float path[LONGEST][4];
static size_t steps;
static float sum;

static double now_ns(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

static fingerpad_motion motion(size_t i)
{
    fingerpad_motion m;
    m.depth_mm = path[i][0];
    m.slide_x_mm = path[i][1];
    m.slide_y_mm = path[i][2];
    m.spin_rad = path[i][3];
    m.dt_s = 1e-3f;
    return m;
}

static void plain(const fingerpad_model *model)
{
    fingerpad_state state;
    fingerpad_response r;
    size_t i;
    must(fingerpad_state_init(&state), "state");
    for (i = 0; i < steps; i++) {
        fingerpad_motion m = motion(i);
        m.spin_rad = 0.0f;
        must(fingerpad_step(model, &state, m, &r), "step");
        sum += r.friction_x_n;
    }
}

static void spinning(const fingerpad_model *model)
{
    fingerpad_spin_state state;
    fingerpad_response r;
    size_t i;
    must(fingerpad_spin_state_init(&state), "state");
    for (i = 0; i < steps; i++) {
        must(fingerpad_spin_step(model, &state, motion(i), &r), "step");
        sum += r.friction_x_n;
    }
}

static void time_of(const char *name, void (*call)(const fingerpad_model *), const fingerpad_model *model)
{
    double least = 1e30;
    int k;
    for (k = 0; k < ROUNDS; k++) {
        const double start = now_ns();
        call(model);
        const double took = now_ns() - start;
        least = took < least ? took : least;
    }
    (void)printf("%s %.2f\n", name, least / (double)steps);
}

int main(int argc, char **argv)
{
    static model_file file;
    fingerpad_model model;
    if (argc != 2) {
        return 2;
    }
    read_file(&file, argv[1]);
    must(fingerpad_model_load(&model, bytes_of(&file), file.length), argv[1]);
    while (steps < LONGEST
           && scanf("%f %f %f %f", &path[steps][0], &path[steps][1], &path[steps][2], &path[steps][3]) == 4) {
        steps++;
    }
    time_of("step", plain, &model);
    time_of("spin_step", spinning, &model);
    return !(sum == sum);
}
