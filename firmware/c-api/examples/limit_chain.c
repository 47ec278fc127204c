/* Holdfast as one more limit in a charger's chain of limits. This is the example of docs/c-api.md; it is C99 and C++.

   The charger is a toy: it prints what it would set. What its firmware has already stands under "yours". */
#include <stdio.h>

#include "holdfast.h"

/* ---- yours ---------------------------------------------------------------------------------------------------- */

/* The table in flash: a pointer to its first byte, and the size of the region that it stands in. */
typedef struct {
    const uint8_t *first;
    size_t size;
} table_region;

/* What the meter says: the frequency falls by 0.25 Hz/s from second 2 on, to 49.4 Hz. */
static int32_t meter_deviation_uhz(uint32_t now_ms)
{
    if (now_ms < 2000u) {
        return 0;
    }
    uint32_t fall_uhz = (now_ms - 2000u) * 250u;
    return -(int32_t)(fall_uhz < 600000u ? fall_uhz : 600000u);
}

static uint32_t cable_limit_ma(void) { return 40000u; }
static uint32_t site_limit_ma(void) { return 32000u; }

static uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }

/* ---- Holdfast --------------------------------------------------------------------------------------------------- */

static holdfast_provider provider;

/* Once, after a reset. */
static int response_start(table_region table, uint32_t serial)
{
    holdfast_config config;
    holdfast_status status = holdfast_default_config(&config, HOLDFAST_DIRECTION_UNIDIRECTIONAL, serial);
    if (status != HOLDFAST_STATUS_OK) {
        return 1;
    }
    config.power_w = 27600u;        /* 3 phases of 230 V and 40 A */
    config.meter_error_uhz = 3000u; /* from the meter's data sheet */
    config.meter_lag_ms = 50u;      /* half of the time that it averages over */
    config.start_fixed_s = 0u;      /* our charger has a random delay of its own after mains returns */
    config.start_random_s = 0u;
    status = holdfast_init(&provider, sizeof provider, table.first, table.size, &config);
    if (status >= HOLDFAST_STATUS_NULL) {
        printf("holdfast_init: status %u\n", (unsigned)status);
        return 1;
    }
    if (status != HOLDFAST_STATUS_OK) {
        uint8_t misfits;
        (void)holdfast_compare(table.first, table.size, &config, &misfits);
        printf("no proof for this charger, the droop is in force: status %u, misfits %#04x\n", (unsigned)status,
               (unsigned)misfits);
    }
    return 0;
}

/* Every holdfast_tick_ms: the current to offer. */
static uint32_t response_limit_ma(uint32_t now_ms, holdfast_output *output)
{
    holdfast_input input = {0, 0, 0, 0, 0, 0, 0, 0};
    input.now_ms = now_ms;
    input.reading = HOLDFAST_READING_VALID;
    input.deviation_uhz = meter_deviation_uhz(now_ms);
    input.car_present = 1;
    input.limit_ma = least(cable_limit_ma(), site_limit_ma());
    input.charge_limit_w = HOLDFAST_NO_LIMIT;
    (void)holdfast_tick(&provider, &input, output);
    return output->current_ma; /* 0 where the call fails */
}

int main(int count, char **names)
{
    static uint8_t flash[131072];
    table_region table = {flash, 0};
    if (count == 2) {
        FILE *file = fopen(names[1], "rb");
        if (file != NULL) {
            table.size = fread(flash, 1, sizeof flash, file);
            (void)fclose(file);
        }
    }
    if (response_start(table, 4711u) != 0) {
        return 1;
    }
    uint32_t last_ma = HOLDFAST_NO_LIMIT;
    for (uint32_t now_ms = 0; now_ms <= 10000u; now_ms += holdfast_tick_ms(&provider)) {
        holdfast_output output;
        uint32_t offered_ma = response_limit_ma(now_ms, &output);
        if (offered_ma != last_ma) {
            printf("%5u ms  %7.3f Hz  offer %5u mA  mode %u  faults %#06x\n", (unsigned)now_ms,
                   50.0 + 1e-6 * (double)output.state[0], (unsigned)offered_ma, (unsigned)output.mode,
                   (unsigned)output.faults);
        }
        last_ma = offered_ma;
    }
    return 0;
}
