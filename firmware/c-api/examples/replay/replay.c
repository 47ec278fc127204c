/* Plays what `cargo fw c-api` recorded on the host: reads calls from the file `calls`, makes them, and writes every
   answer to the file `answers`. On a bare Cortex-M the files are the emulator's; on the host they are files. The two
   must write the same bytes.

   calls:    flags (1: measure), number of tables, for each its length and its bytes (filled up to whole words); then
             records of a kind and its words:
               START     table's number, holdfast_config
               WINDOW    table's number, holdfast_config, holdfast_captures_config
               TICK      holdfast_input
               CROSSING  time stamp, time in ms
               READ      holdfast_input: the window's reading is filled in, then as TICK
               END
   answers:  START and WINDOW a status in a word; TICK and READ the status and holdfast_output; then, after END, five
             words that only a target measures: bytes of a provider, stack of the dearest start and of the dearest tick,
             timer's ticks of the dearest start and of the dearest tick. */
#include <stdint.h>

#include "holdfast.h"
#include "port.h"

enum { END = 0, START = 1, WINDOW = 2, TICK = 3, CROSSING = 4, READ = 5 };
enum { TABLES_MAX = 8, TABLE_WORDS = 16384 };

static uint32_t tables[TABLE_WORDS];
static const uint32_t *table_start[TABLES_MAX];
static uint32_t table_length[TABLES_MAX];

static holdfast_provider provider;
static holdfast_captures captures;

static uint32_t measures;
static uint32_t worst_stack[2];
static uint32_t worst_time[2];

/* What is measured: a start or a tick. */
enum { OF_START = 0, OF_TICK = 1 };

static void begin(uint32_t *time)
{
    if (measures != 0u) {
        port_paint();
    }
    *time = port_time();
}

static void end(uint32_t time, unsigned what)
{
    uint32_t elapsed = port_elapsed(time, port_time());
    if (measures != 0u) {
        uint32_t stack = port_stack();
        if (stack > worst_stack[what]) {
            worst_stack[what] = stack;
        }
        if (elapsed > worst_time[what]) {
            worst_time[what] = elapsed;
        }
    }
}

static int read_tables(void)
{
    uint32_t head[2];
    uint32_t used = 0;
    if (port_read(head, sizeof head) != 0 || head[1] > TABLES_MAX) {
        return 1;
    }
    measures = head[0];
    for (uint32_t n = 0; n < head[1]; n++) {
        uint32_t length;
        if (port_read(&length, sizeof length) != 0) {
            return 1;
        }
        uint32_t words = (length + 3u) / 4u;
        if (words > TABLE_WORDS - used || port_read(&tables[used], words * 4u) != 0) {
            return 1;
        }
        table_start[n] = &tables[used];
        table_length[n] = length;
        used += words;
    }
    return 0;
}

static int start(int with_window)
{
    uint32_t table;
    holdfast_config config;
    holdfast_captures_config window;
    uint32_t status = HOLDFAST_STATUS_OK;
    uint32_t time;
    if (port_read(&table, sizeof table) != 0 || table >= TABLES_MAX || port_read(&config, sizeof config) != 0) {
        return 1;
    }
    if (with_window != 0) {
        if (port_read(&window, sizeof window) != 0) {
            return 1;
        }
        status = holdfast_captures_init(&captures, sizeof captures, &window, &config);
    }
    if (status == HOLDFAST_STATUS_OK) {
        begin(&time);
        status = holdfast_init(&provider, sizeof provider, (const uint8_t *)table_start[table], table_length[table], &config);
        end(time, OF_START);
    }
    return port_write(&status, sizeof status);
}

static int tick(int from_window)
{
    holdfast_input input;
    holdfast_output output;
    uint32_t time;
    if (port_read(&input, sizeof input) != 0) {
        return 1;
    }
    if (from_window != 0 && holdfast_captures_read(&captures, input.now_ms, &input) != HOLDFAST_STATUS_OK) {
        return 1;
    }
    begin(&time);
    uint32_t status = holdfast_tick(&provider, &input, &output);
    end(time, OF_TICK);
    if (port_write(&status, sizeof status) != 0) {
        return 1;
    }
    return port_write(&output, sizeof output);
}

static int crossing(void)
{
    uint32_t at[2];
    if (port_read(at, sizeof at) != 0) {
        return 1;
    }
    return holdfast_captures_add(&captures, at[0], at[1]) != HOLDFAST_STATUS_OK;
}

int main(void)
{
    if (port_open() != 0 || read_tables() != 0) {
        return 1;
    }
    for (;;) {
        uint32_t kind;
        int failed;
        if (port_read(&kind, sizeof kind) != 0) {
            return 1;
        }
        switch (kind) {
        case START:
        case WINDOW:
            failed = start(kind == WINDOW);
            break;
        case TICK:
        case READ:
            failed = tick(kind == READ);
            break;
        case CROSSING:
            failed = crossing();
            break;
        case END: {
            uint32_t facts[5] = {(uint32_t)holdfast_size(), worst_stack[OF_START], worst_stack[OF_TICK],
                                 worst_time[OF_START], worst_time[OF_TICK]};
            if (port_write(facts, sizeof facts) != 0) {
                return 1;
            }
            return port_close();
        }
        default:
            return 1;
        }
        if (failed != 0) {
            return 1;
        }
    }
}
