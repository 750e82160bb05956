/* The model from C on a bare Cortex-M4F: steps through the test vectors of core/docs/fpm-format.md and prints the bits.
 * Start-up, output and exit are all here; no C library is used. */
#include "fingerpad.h"

extern uint32_t stack_top;
void reset(void);
void fault(void);

__attribute__((section(".vector_table"), used)) static void *const vectors[16] = {
    &stack_top, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault,
};

__asm__(".section .rodata.model\n.balign 8\n.global model_start\nmodel_start:\n.incbin \"../../data/models/fingertip.fpm\"\n"
        ".global model_end\nmodel_end:\n.previous\n");
extern const uint8_t model_start[], model_end[];

static uint32_t semihosting(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void print(const char *text)
{
    static uint32_t out; /* the host's standard output, opened at the first use */
    if (out == 0) {
        const uint32_t open[3] = {(uint32_t)":tt", 4, 3};
        out = semihosting(0x01, open);
    }
    uint32_t length = 0;
    while (text[length])
        length++;
    const uint32_t block[3] = {out, (uint32_t)text, length};
    semihosting(0x05, block);
}

static void leave(uint32_t status)
{
    const uint32_t block[2] = {0x20026, status};
    for (;;)
        semihosting(0x20, block);
}

void fault(void)
{
    print("fault\n");
    leave(2);
}

static void print_word(uint32_t word)
{
    char text[10];
    for (int i = 0; i < 8; i++)
        text[i] = "0123456789abcdef"[(word >> (28 - 4 * i)) & 15];
    text[8] = ' ';
    text[9] = 0;
    print(text);
}

static uint32_t bits(float x)
{
    union {
        float f;
        uint32_t u;
    } both = {x};
    return both.u;
}

static const float motions[][3] = {
    {0.5f, 0, 0}, {1, 0, 0}, {1, 1.5f, 0}, {1, 0, 2}, {0.7f, -0.25f, 0}, {3, 0, 0}, {1, __builtin_nanf(""), 0.125f}, {0, 0, 0},
};

/* Not inlined: reset must not use the FPU before it is on. */
__attribute__((noinline)) static void step_through_vectors(void)
{
    static fingerpad_model model;
    static fingerpad_state state;
    if (fingerpad_model_load(&model, model_start, (size_t)(model_end - model_start)) != FINGERPAD_OK) {
        print("model refused\n");
        leave(1);
    }
    (void)fingerpad_state_init(&state);
    for (unsigned i = 0; i < sizeof motions / sizeof *motions; i++) {
        const fingerpad_motion motion = {motions[i][0], motions[i][1], motions[i][2], 0, 1e-3f};
        fingerpad_response r;
        if (fingerpad_step(&model, &state, motion, &r) != FINGERPAD_OK) {
            print("step refused\n");
            leave(1);
        }
        print_word(bits(r.normal_force_n));
        print_word(bits(r.friction_x_n));
        print_word(bits(r.friction_y_n));
        print_word(bits(r.stick_ratio));
        print_word(bits(r.friction_limit_n));
        print_word(bits(r.slip_margin));
        print_word(bits(r.contact_area_mm2));
        print_word(bits(r.band_normal_n));
        print_word(bits(r.band_friction_n));
        const char text[] = {(char)('0' + r.regime), ' ', 0};
        print(text);
        const char status[] = {(char)('0' + r.status / 10), (char)('0' + r.status % 10), '\n', 0};
        print(r.status < 10 ? status + 1 : status);
    }
    leave(0);
}

void reset(void)
{
    *(volatile uint32_t *)0xE000ED88 |= 0xF << 20; /* the FPU */
    __asm__ volatile("dsb\nisb" ::: "memory");
    step_through_vectors();
}
