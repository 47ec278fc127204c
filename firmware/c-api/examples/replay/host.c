/* The replay on the host: files are files, and nothing is measured. */
#include <stdio.h>

#include "port.h"

static FILE *calls;
static FILE *answers;

int port_open(void)
{
    calls = fopen("calls", "rb");
    answers = fopen("answers", "wb");
    return calls == NULL || answers == NULL;
}

int port_read(void *bytes, uint32_t count) { return fread(bytes, 1, count, calls) != count; }

int port_write(const void *bytes, uint32_t count) { return fwrite(bytes, 1, count, answers) != count; }

int port_close(void) { return fclose(answers) != 0; }

uint32_t port_time(void) { return 0; }

uint32_t port_elapsed(uint32_t from, uint32_t to) { return to - from; }

void port_paint(void) {}

uint32_t port_stack(void) { return 0; }
