/* What the programs share: a model file in memory, numbers as their bits. */
#ifndef CONSUMER_COMMON_H
#define CONSUMER_COMMON_H

#include <fingerpad.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MODEL_WORDS 4096
/* The pad that ships, and one of more patches. */
#define PAD_NAME "fingertip-pad.fpm"
#define HALVED_NAME "halved-pad.fpm"
#define RELAXING_NAME "relaxing-pad.fpm"
#define RELAXING_BED_NAME "relaxing-bed.fpm"

/* A model file, at an address divisible by 8. */
typedef struct {
    uint64_t words[MODEL_WORDS];
    size_t length;
} model_file;

static inline const uint8_t *bytes_of(const model_file *file)
{
    return (const uint8_t *)file->words;
}

static inline void read_file(model_file *file, const char *path)
{
    FILE *from = fopen(path, "rb");
    if (from == NULL) {
        perror(path);
        exit(2);
    }
    file->length = fread(file->words, 1, sizeof file->words, from);
    (void)fclose(from);
}

/* A pad that lies beside another model file. */
static inline void read_pad(model_file *file, const char *name, const char *beside)
{
    char path[4096];
    const char *const slash = strrchr(beside, '/');
    const int folder = slash == NULL ? 0 : (int)(slash - beside + 1);
    (void)snprintf(path, sizeof path, "%.*s%s", folder, beside, name);
    read_file(file, path);
}

static inline void must(int32_t code, const char *what)
{
    if (code != FINGERPAD_OK) {
        (void)fprintf(stderr, "%s: %s\n", what, fingerpad_error_text(code));
        exit(2);
    }
}

static inline uint32_t bits(float x)
{
    uint32_t word;
    (void)memcpy(&word, &x, sizeof word);
    return word;
}

static inline float number(uint32_t word)
{
    float x;
    (void)memcpy(&x, &word, sizeof x);
    return x;
}

#endif
