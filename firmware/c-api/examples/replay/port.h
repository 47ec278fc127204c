/* What the replay asks of where it runs. Functions that return an int return 0 when they did what they should. */
#ifndef PORT_H
#define PORT_H

#include <stdint.h>

/* Opens the files `calls` and `answers`. */
int port_open(void);

/* So many bytes of `calls`. */
int port_read(void *bytes, uint32_t count);

/* So many bytes to `answers`. */
int port_write(const void *bytes, uint32_t count);

/* The end of `answers`. */
int port_close(void);

/* A timer, and its ticks between two moments; 0 on the host. */
uint32_t port_time(void);
uint32_t port_elapsed(uint32_t from, uint32_t to);

/* Paints unused stack; then the bytes of it that were used since; 0 on the host. */
void port_paint(void);
uint32_t port_stack(void);

#endif
