/* Holdfast: frequency response for EV chargers, as one more limit in a charger's chain of limits.

   Written by cbindgen from firmware/c-api/src; do not edit. How to use it: docs/c-api.md. */

#ifndef HOLDFAST_H
#define HOLDFAST_H

#include <stddef.h>
#include <stdint.h>

// Version of this interface; the first field of a configuration.
#define HOLDFAST_VERSION 1

// No limit, in a limit of the input.
#define HOLDFAST_NO_LIMIT 4294967295

// The meter's error is not known yet: the configuration is refused.
#define HOLDFAST_METER_UNKNOWN 4294967295

// Ticks of warm-up by the plant that the table names.
#define HOLDFAST_WARM_UP_BY_PLANT 65535

// Fault: the meter did not answer.
#define HOLDFAST_FAULT_BUS 1

// Fault: no complete measurement.
#define HOLDFAST_FAULT_NO_SIGNAL 2

// Fault: the reading is too old.
#define HOLDFAST_FAULT_STALE 4

// Fault: the reading does not move.
#define HOLDFAST_FAULT_STUCK 8

// Fault: the reading is out of range.
#define HOLDFAST_FAULT_OUT_OF_RANGE 16

// Fault: the reading jumped.
#define HOLDFAST_FAULT_IMPLAUSIBLE 32

// Fault: the table was rejected.
#define HOLDFAST_FAULT_TABLE_REJECTED 64

// Fault: no law of the table covers the state.
#define HOLDFAST_FAULT_OUTSIDE_DOMAIN 128

// Fault: ticks were missed and caught up.
#define HOLDFAST_FAULT_OVERRUN 256

// Fault: the clock jumped.
#define HOLDFAST_FAULT_CLOCK_JUMP 512

// Fault: restarted by brown-out or watchdog, and not trusted yet.
#define HOLDFAST_FAULT_RESTARTED 1024

// Fault: the charger is not what the table's proof assumed.
#define HOLDFAST_FAULT_MISFIT 4096

// Misfit: the meter's error is larger than the proof assumed.
#define HOLDFAST_MISFIT_METER_ERROR 1

// Misfit: the meter's lag lies outside.
#define HOLDFAST_MISFIT_METER_LAG 2

// Misfit: the table's tick is longer than the charger keeps.
#define HOLDFAST_MISFIT_TICK 4

// Misfit: the charger moves power the other way.
#define HOLDFAST_MISFIT_DIRECTION 8

// Misfit: the charger's power is another.
#define HOLDFAST_MISFIT_POWER 16

// Misfit: a change of the set-point may wait too long; the provider never says so.
#define HOLDFAST_MISFIT_PACE 32

// How a call ended.
enum holdfast_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Done.
  HOLDFAST_STATUS_OK = 0,
  // Done, but the table is rejected: the provider runs the droop. holdfast_read_table says why.
  HOLDFAST_STATUS_TABLE_REJECTED = 1,
  // Done, but the charger is not what the table's proof assumed: the provider runs the droop.
  HOLDFAST_STATUS_MISFIT = 2,
  // A pointer is NULL.
  HOLDFAST_STATUS_NULL = 16,
  // The memory is too small: its size must be that of the type in this header.
  HOLDFAST_STATUS_TOO_SMALL = 17,
  // A pointer is not aligned for its type.
  HOLDFAST_STATUS_MISALIGNED = 18,
  // The memory holds nothing yet: call the init function first.
  HOLDFAST_STATUS_NOT_INITIALISED = 19,
  // The configuration is of another version of this header.
  HOLDFAST_STATUS_WRONG_VERSION = 20,
  // Neither unidirectional nor bidirectional.
  HOLDFAST_STATUS_BAD_DIRECTION = 21,
  // Not 1 to 3 phases of 1 to 1000 V.
  HOLDFAST_STATUS_BAD_CONNECTION = 22,
  // A power of 0 W.
  HOLDFAST_STATUS_BAD_POWER = 23,
  // A longest tick of 0 ms.
  HOLDFAST_STATUS_BAD_TICK = 24,
  // The meter's error is not given, or more than 10 Hz.
  HOLDFAST_STATUS_BAD_METER = 25,
  // Limits on readings of zero, or a range of more than 10 Hz.
  HOLDFAST_STATUS_BAD_GATE = 26,
  // A filter of none or more than 8 ticks.
  HOLDFAST_STATUS_BAD_FILTER = 27,
  // A release that never ends, or of more than 1000000 ppm a tick.
  HOLDFAST_STATUS_BAD_RELEASE = 28,
  // Not a cause of a reset.
  HOLDFAST_STATUS_BAD_RESET_CAUSE = 29,
  // A timer below 50 kHz or above 200 MHz.
  HOLDFAST_STATUS_BAD_TIMER = 30,
  // A window of none or more than 16 cycles.
  HOLDFAST_STATUS_BAD_CYCLES = 31,
  // Neither 50 nor 60 Hz.
  HOLDFAST_STATUS_BAD_NOMINAL = 32,
  // A jitter of more than 1 ms, or a clock that is wrong by more than 1000 ppm.
  HOLDFAST_STATUS_BAD_CLOCK = 33,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum holdfast_status holdfast_status;
#else
typedef uint8_t holdfast_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Which way the charger can move power.
enum holdfast_direction
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Charging can be reduced, at most to nothing.
  HOLDFAST_DIRECTION_UNIDIRECTIONAL = 0,
  // Charging can be reversed.
  HOLDFAST_DIRECTION_BIDIRECTIONAL = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum holdfast_direction holdfast_direction;
#else
typedef uint8_t holdfast_direction;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What the meter has to say at a tick.
enum holdfast_reading
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The mains is not there, or nothing was measured yet.
  HOLDFAST_READING_NONE = 0,
  // The deviation is valid.
  HOLDFAST_READING_VALID = 1,
  // The meter did not answer. Any other number counts as this.
  HOLDFAST_READING_METER_FAILED = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum holdfast_reading holdfast_reading;
#else
typedef uint8_t holdfast_reading;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Who decided at a tick.
enum holdfast_mode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The state estimate is not trusted yet: droop.
  HOLDFAST_MODE_WARM_UP = 0,
  // The table.
  HOLDFAST_MODE_TABLE = 1,
  // No law of the table covers the state: droop.
  HOLDFAST_MODE_DROOP_OUTSIDE = 2,
  // The table was rejected: droop.
  HOLDFAST_MODE_DROOP_NO_TABLE = 3,
  // Frequency lost for a moment: the last participation.
  HOLDFAST_MODE_HOLD = 4,
  // Frequency lost: back to ordinary charging.
  HOLDFAST_MODE_SAFE = 5,
  // The event is over: step by step back to ordinary charging.
  HOLDFAST_MODE_RELEASE = 6,
  // The charger is not what the table's proof assumed: droop.
  HOLDFAST_MODE_DROOP_MISFIT = 7,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum holdfast_mode holdfast_mode;
#else
typedef uint8_t holdfast_mode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The law in force.
enum holdfast_phase
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No event.
  HOLDFAST_PHASE_NO_CONTROL = 0,
  // The law that reaches the outer band.
  HOLDFAST_PHASE_C1 = 1,
  // The law that reaches the inner band.
  HOLDFAST_PHASE_C2 = 2,
  // The last participation is held.
  HOLDFAST_PHASE_FIXED = 3,
  // The law that keeps the frequency in the inner band.
  HOLDFAST_PHASE_HOLD = 4,
  // The droop.
  HOLDFAST_PHASE_FALLBACK = 5,
  // The law that is always on.
  HOLDFAST_PHASE_RESPONSE = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum holdfast_phase holdfast_phase;
#else
typedef uint8_t holdfast_phase;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why the controller started.
enum holdfast_reset_cause
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Power was applied, or a person pressed reset.
  HOLDFAST_RESET_CAUSE_POWER_ON = 0,
  // The supply dipped.
  HOLDFAST_RESET_CAUSE_BROWN_OUT = 1,
  // The watchdog bit.
  HOLDFAST_RESET_CAUSE_WATCHDOG = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum holdfast_reset_cause holdfast_reset_cause;
#else
typedef uint8_t holdfast_reset_cause;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why a table was rejected.
enum holdfast_table_fault
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It was not.
  HOLDFAST_TABLE_FAULT_NONE = 0,
  // Fewer bytes than a header.
  HOLDFAST_TABLE_FAULT_TOO_SHORT = 1,
  // Not a table: erased or foreign flash.
  HOLDFAST_TABLE_FAULT_BAD_MAGIC = 2,
  // Bytes in the wrong order.
  HOLDFAST_TABLE_FAULT_BYTE_ORDER = 3,
  // Another version of the format.
  HOLDFAST_TABLE_FAULT_UNSUPPORTED_VERSION = 4,
  // The header's length is not the table's.
  HOLDFAST_TABLE_FAULT_WRONG_LENGTH = 5,
  // The CRC does not match.
  HOLDFAST_TABLE_FAULT_BAD_CRC = 6,
  // Made for another device.
  HOLDFAST_TABLE_FAULT_FOREIGN_SPEC = 7,
  // The header's grid is impossible.
  HOLDFAST_TABLE_FAULT_BAD_GRID = 8,
  // A field of the header is out of its range.
  HOLDFAST_TABLE_FAULT_BAD_FIELD = 9,
  // The block of a law is malformed.
  HOLDFAST_TABLE_FAULT_BAD_BLOCK = 10,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum holdfast_table_fault holdfast_table_fault;
#else
typedef uint8_t holdfast_table_fault;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a provider is told once. Call holdfast_default_config first, then change what is different.
typedef struct holdfast_config {
  // HOLDFAST_VERSION.
  uint32_t version;
  // holdfast_direction: which way the charger can move power.
  uint8_t direction;
  // Phases that carry the current, 1 to 3.
  uint8_t phases;
  // Nominal voltage of a phase in V.
  uint16_t voltage_v;
  // Power by which the charger moves the balance at full response, in W: its rated power, or
  // twice that if it can discharge.
  uint32_t power_w;
  // Serial number: the place in the fleet. Chargers of a fleet must have different ones.
  uint32_t serial;
  // Bound on a reading's error, lag apart, in uHz. No default: it is the meter's.
  uint32_t meter_error_uhz;
  // Delay of a reading behind the frequency, in ms: half of the meter's averaging time.
  uint16_t meter_lag_ms;
  // Ticks of unchanged readings after which the meter is stuck; 0 for meters that may repeat
  // themselves.
  uint16_t stuck_after_ticks;
  // Longest time between two ticks that the charger guarantees, by its watchdog, in ms.
  uint16_t tick_most_ms;
  // Ticks without frequency for which the last response is held.
  uint16_t hold_ticks;
  // What a tick lets go of the response after that, in ppm.
  uint32_t release_ppm;
  // Largest deviation from nominal that is believed, in uHz.
  uint32_t range_uhz;
  // Fastest change that is believed, in uHz/s.
  uint32_t rate_uhz_per_s;
  // Lowest deviation at which an event counts as recovered, in uHz.
  int32_t recovered_uhz;
  // Time for which the frequency must have recovered until an event is over, in s.
  uint16_t recovered_s;
  // Time in which the response is then let go, in s.
  uint16_t recovered_release_s;
  // Oldest reading that is believed, in ms.
  uint16_t age_ms;
  // Ticks until the state estimate is trusted; HOLDFAST_WARM_UP_BY_PLANT but in simulations.
  uint16_t warm_up_ticks;
  // Delay of the start that is the same for all chargers, in s.
  uint16_t start_fixed_s;
  // Most of the delay of the start that is drawn at random, in s.
  uint16_t start_random_s;
  // Ticks of the moving average, 1 to 8; 1 for none.
  uint8_t filter_ticks;
  // holdfast_reset_cause: why the controller started.
  uint8_t reset_cause;
  // 0.
  uint16_t reserved;
} holdfast_config;

// Memory of a provider: the caller's, zeroed or initialised before it is used. Nothing in it may
// be changed by the caller. It may be moved between calls.
//
// Counted in words of the core's own size, for most of it is numbers and pointers.
typedef struct holdfast_provider {
  // Not for the caller.
  size_t words[256];
} holdfast_provider;

// What a provider is told at every tick.
typedef struct holdfast_input {
  // A clock in ms that may wrap.
  uint32_t now_ms;
  // Deviation of the frequency from nominal in uHz.
  int32_t deviation_uhz;
  // Age of that reading in ms.
  uint16_t age_ms;
  // holdfast_reading: whether the deviation is valid.
  uint8_t reading;
  // Whether a car is connected that may be charged: 0 no, anything else yes.
  uint8_t car_present;
  // Lowest limit on the current of a phase in mA; HOLDFAST_NO_LIMIT for none.
  uint32_t limit_ma;
  // Lowest limit on charging in W; HOLDFAST_NO_LIMIT for none.
  uint32_t charge_limit_w;
  // Lowest limit on discharging in W; 0 where the car must not be discharged.
  uint32_t discharge_limit_w;
} holdfast_input;

// What is allowed until the next tick, and why. All zeros where a call fails: nothing is allowed.
typedef struct holdfast_output {
  // Ticks since the start.
  uint32_t sequence;
  // Power drawn from the grid in W: the most for a charger that can only charge, the set-point
  // for a bidirectional one, negative while discharging.
  int32_t power_w;
  // Current of a phase that belongs to it, in mA.
  uint32_t current_ma;
  // Share of the charger's power that responds, in ppm.
  uint32_t participation_ppm;
  // Believed deviation of the frequency in uHz, then the estimates of governor, lead-lag and
  // turbine in kW, which are 0 for tables that need none.
  int32_t state[4];
  // Estimate of the lost power in kW; 0 if it is not known.
  int32_t loss_kw;
  // Bits HOLDFAST_FAULT_*: what was wrong at this tick.
  uint16_t faults;
  // Bits HOLDFAST_MISFIT_*: what the table's proof assumed otherwise.
  uint8_t misfits;
  // holdfast_mode: who decided.
  uint8_t mode;
  // holdfast_phase: the law in force.
  uint8_t phase;
  // Whether anything may be energised: 1 if a car is present and the start is over.
  uint8_t energise;
  // Whether loss_kw is known.
  uint8_t loss_known;
  // 0.
  uint8_t reserved;
} holdfast_output;

// What a window of zero crossings is told once.
typedef struct holdfast_captures_config {
  // Rate of the timer in Hz, 50 kHz to 200 MHz.
  uint32_t timer_hz;
  // Most by which a crossing is captured early or late, in ns, at most 1 ms.
  uint32_t jitter_ns;
  // Tolerance of the timer's clock in ppm, at most 1000.
  uint16_t clock_ppm;
  // Cycles of the window, 1 to 16; 5 are 100 ms at 50 Hz.
  uint8_t cycles;
  // Nominal frequency: 50 or 60 Hz.
  uint8_t nominal_hz;
} holdfast_captures_config;

// Memory of a window of zero crossings, as that of a provider.
typedef struct holdfast_captures {
  // Not for the caller.
  size_t words[40];
} holdfast_captures;

// What is known of a table.
typedef struct holdfast_table_info {
  // First half of the SHA-256 of the spec that the table was made from.
  uint8_t spec_hash[16];
  // Bytes of the table.
  uint32_t length;
  // CRC-32 of its bytes.
  uint32_t crc;
  // Version: a newer table has a larger one.
  uint32_t table_version;
  // Version of the program that made it: major, minor, patch in bits 24, 12 and 0 upwards.
  uint32_t generator;
  // Power by which one charger moves the balance, in W, as the proof assumed.
  uint32_t power_per_charger_w;
  // Chargers of the fleet, as the proof assumed.
  uint32_t chargers;
  // Bound on the meter's error that the proof assumed, in uHz.
  uint32_t meter_error_uhz;
  // Least lag of the meter that the proof assumed, in ms.
  uint16_t meter_lag_least_ms;
  // Most of it.
  uint16_t meter_lag_most_ms;
  // Length of a tick in ms.
  uint16_t tick_ms;
  // holdfast_direction that the proof assumed.
  uint8_t direction;
  // holdfast_table_fault: why the table is rejected; everything else is 0 then.
  uint8_t fault;
} holdfast_table_info;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Bytes of a holdfast_provider, as the library has it.
size_t holdfast_size(void);

// Alignment of a holdfast_provider, as the library has it.
size_t holdfast_align(void);

// Fills a configuration with the defaults of the reference charger: 3 phases of 230 V, 22 kW in
// one direction or 28 kW in both. The meter's error has no default, for nobody knows it but you.
//
// # Safety
// `config` is NULL, or may be written and is not used by anybody else during the call.
holdfast_status holdfast_default_config(struct holdfast_config *config,
                                        uint8_t direction,
                                        uint32_t serial);

// Makes a provider in the caller's memory of `size` bytes. `table` is the table, or a region of
// flash that begins with it; `length` are its bytes. It is checked here, and read at every tick:
// it must stay where it is, and as it is, for as long as the provider is used.
//
// HOLDFAST_STATUS_TABLE_REJECTED and HOLDFAST_STATUS_MISFIT leave a provider that works and runs
// the droop; numbers from 16 on leave none.
//
// # Safety
// Each pointer is NULL or as described, and nobody else uses the memory during the call.
holdfast_status holdfast_init(void *provider,
                              size_t size,
                              const uint8_t *table,
                              size_t length,
                              const struct holdfast_config *config);

// One tick, to be called every holdfast_tick_ms by a clock of milliseconds that may wrap. Late
// ticks are caught up. `output` is what is allowed until the next tick; where the call fails,
// nothing is.
//
// # Safety
// `provider` is NULL, or zeroed or initialised memory of that type; `input` is NULL or an input;
// `output` is NULL or may be written. Nobody else uses them during the call.
holdfast_status holdfast_tick(struct holdfast_provider *provider,
                              const struct holdfast_input *input,
                              struct holdfast_output *output);

// Length of a tick in ms; 0 if there is no provider.
//
// # Safety
// `provider` is NULL, or zeroed or initialised memory of that type.
uint16_t holdfast_tick_ms(struct holdfast_provider *provider);

// Bytes of a holdfast_captures, as the library has it.
size_t holdfast_captures_size(void);

// Makes a window of zero crossings in the caller's memory of `size` bytes, and fills the meter's
// fields of the provider's configuration: error and lag.
//
// # Safety
// Each pointer is NULL or as described, and nobody else uses the memory during the call.
holdfast_status holdfast_captures_init(void *captures,
                                       size_t size,
                                       const struct holdfast_captures_config *captures_config,
                                       struct holdfast_config *config);

// Takes the timer's count at a positive-going crossing, seen at `now_ms` of the clock of the
// ticks.
//
// # Safety
// `captures` is NULL, or zeroed or initialised memory of that type that nobody else uses during
// the call.
holdfast_status holdfast_captures_add(struct holdfast_captures *captures,
                                      uint32_t stamp,
                                      uint32_t now_ms);

// A crossing was captured and lost before it was taken: the window starts again.
//
// # Safety
// As for holdfast_captures_add.
holdfast_status holdfast_captures_lost(struct holdfast_captures *captures);

// Fills the time and the reading of an input: now_ms, deviation_uhz, age_ms and reading.
//
// # Safety
// As for holdfast_captures_add; `input` is NULL or an input that nobody else uses.
holdfast_status holdfast_captures_read(struct holdfast_captures *captures,
                                       uint32_t now_ms,
                                       struct holdfast_input *input);

// Checks a table and says what it is. HOLDFAST_STATUS_TABLE_REJECTED if it is none: `info->fault`
// says why.
//
// # Safety
// Each pointer is NULL or as described, and nobody else uses `info` during the call.
holdfast_status holdfast_read_table(const uint8_t *table,
                                    size_t length,
                                    struct holdfast_table_info *info);

// Compares a charger with what the table's proof assumed, before a provider is made.
// HOLDFAST_STATUS_MISFIT if something is otherwise: `found` holds the bits HOLDFAST_MISFIT_*.
//
// # Safety
// Each pointer is NULL or as described, and nobody else uses `found` during the call.
holdfast_status holdfast_compare(const uint8_t *table,
                                 size_t length,
                                 const struct holdfast_config *config,
                                 uint8_t *found);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HOLDFAST_H */
