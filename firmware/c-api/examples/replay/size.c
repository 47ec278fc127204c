/* A program that uses the provider and nothing else of the library, to be measured: `cargo fw c-api` reads the library's
   bytes from the linked file. It is not run. */
#include "holdfast.h"
#include "port.h"

static holdfast_provider provider;

int main(void)
{
    static uint8_t table[512];
    holdfast_config config;
    holdfast_input input = {0, 0, 0, 0, 0, 0, 0, 0};
    holdfast_output output;
    holdfast_table_info info;
    if (port_open() != 0 || port_read(table, sizeof table) != 0) {
        return 1;
    }
    if (holdfast_read_table(table, sizeof table, &info) != HOLDFAST_STATUS_OK) {
        return 1;
    }
    (void)holdfast_default_config(&config, HOLDFAST_DIRECTION_UNIDIRECTIONAL, 1);
    config.meter_error_uhz = info.meter_error_uhz;
    (void)holdfast_init(&provider, sizeof provider, table, sizeof table, &config);
    for (input.now_ms = 0; input.now_ms < 1000u; input.now_ms += holdfast_tick_ms(&provider)) {
        (void)holdfast_tick(&provider, &input, &output);
        (void)port_write(&output, sizeof output);
    }
    return port_close();
}
