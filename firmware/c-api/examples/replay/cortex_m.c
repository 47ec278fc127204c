/* The replay on a bare Cortex-M in an emulator: start, files by semihosting, the system timer, the stack's paint. No C
   library. */
#include <stdint.h>

#include "port.h"

int main(void);

/* ---- semihosting ------------------------------------------------------------------------------------------------ */

enum { SYS_OPEN = 0x01, SYS_CLOSE = 0x02, SYS_WRITE = 0x05, SYS_READ = 0x06, SYS_EXIT_EXTENDED = 0x20 };
enum { MODE_READ_BINARY = 1, MODE_WRITE_BINARY = 5 };
#define STOPPED 0x20026u

static int host(int operation, const void *arguments)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static int host_open(const char *name, uint32_t length, uint32_t mode)
{
    uint32_t arguments[3] = {(uint32_t)name, mode, length};
    return host(SYS_OPEN, arguments);
}

static void stop(int status)
{
    uint32_t arguments[2] = {STOPPED, (uint32_t)status};
    for (;;) {
        (void)host(SYS_EXIT_EXTENDED, arguments);
    }
}

/* ---- files, in blocks ------------------------------------------------------------------------------------------- */

enum { BLOCK = 16384 };

static int calls;
static int answers;
static uint8_t in[BLOCK];
static uint8_t out[BLOCK];
static uint32_t in_next, in_end, out_next;

int port_open(void)
{
    calls = host_open("calls", 5, MODE_READ_BINARY);
    answers = host_open("answers", 7, MODE_WRITE_BINARY);
    return calls < 0 || answers < 0;
}

int port_read(void *bytes, uint32_t count)
{
    uint8_t *to = bytes;
    for (; count > 0u; count--) {
        if (in_next == in_end) {
            uint32_t arguments[3] = {(uint32_t)calls, (uint32_t)in, BLOCK};
            /* The answer is what was not read. */
            uint32_t left = (uint32_t)host(SYS_READ, arguments);
            if (left >= BLOCK) {
                return 1;
            }
            in_next = 0;
            in_end = BLOCK - left;
        }
        *to++ = in[in_next++];
    }
    return 0;
}

static int flush(void)
{
    uint32_t arguments[3] = {(uint32_t)answers, (uint32_t)out, out_next};
    out_next = 0;
    return host(SYS_WRITE, arguments) != 0;
}

int port_write(const void *bytes, uint32_t count)
{
    const uint8_t *from = bytes;
    for (; count > 0u; count--) {
        if (out_next == BLOCK && flush() != 0) {
            return 1;
        }
        out[out_next++] = *from++;
    }
    return 0;
}

int port_close(void)
{
    uint32_t file = (uint32_t)answers;
    return flush() != 0 || host(SYS_CLOSE, &file) != 0;
}

/* ---- timer ------------------------------------------------------------------------------------------------------ */

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
#define SYST_MASK 0xFFFFFFu

static void timer_start(void)
{
    SYST_RVR = SYST_MASK;
    SYST_CVR = 0;
    SYST_CSR = 5; /* enabled, on the core's clock, without interrupts */
}

uint32_t port_time(void) { return SYST_CVR; }

/* It counts down. */
uint32_t port_elapsed(uint32_t from, uint32_t to) { return (from - to) & SYST_MASK; }

/* ---- stack ------------------------------------------------------------------------------------------------------ */

enum { PAINTED_WORDS = 2048, LEFT_WORDS = 16 };
#define PAINT 0xCCCCCCCCu

static volatile uint32_t *painted;

/* Leaves what this function may use itself alone; it counts as used. */
__attribute__((noinline)) void port_paint(void)
{
    volatile uint32_t *top = (volatile uint32_t *)__builtin_frame_address(0) - LEFT_WORDS;
    painted = top - PAINTED_WORDS;
    for (uint32_t n = 0; n < PAINTED_WORDS; n++) {
        painted[n] = PAINT;
    }
}

__attribute__((noinline)) uint32_t port_stack(void)
{
    uint32_t n = 0;
    while (n < PAINTED_WORDS && painted[n] == PAINT) {
        n++;
    }
    return (PAINTED_WORDS - n + LEFT_WORDS) * 4u;
}

/* ---- start ------------------------------------------------------------------------------------------------------ */

extern uint32_t stack_top, bss_start, bss_end;

void reset(void);
void reset(void)
{
    for (uint32_t *word = &bss_start; word < &bss_end; word++) {
        *word = 0;
    }
#if defined(__ARM_FP)
    /* The floating-point unit: full access. */
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm__ volatile("dsb\n isb");
#endif
    timer_start();
    stop(main());
}

static void fault(void) { stop(2); }

/* The stack's start, then the handlers of reset and of the faults. Nothing else is enabled. */
static const struct {
    uint32_t *stack;
    void (*handlers[15])(void);
} vectors __attribute__((section(".vectors"), used)) = {&stack_top, {reset, fault, fault, fault, fault, fault}};
