/* An Arduino UNO in libsimavr with two motors and two slotted discs on its pins, in lock-step with its caller.
 *
 *   uno BAUD MOTOR MOTOR      MOTOR = encoder,enable,forward,backward,pulses,free,dead,lag,brake,coast
 *
 * The caller writes a request on stdin: let so much time pass, with these faults, and here are bytes for the UART, or
 * another program for the flash. The answer on stdout is what the board did in that time: the truth about its wheels, and
 * the bytes that it sent. All numbers are little-endian. Time is the board's own clock and nothing else, so the same
 * requests give the same answers.
 */
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_time.h>

enum { F_CPU_HZ = 16000000, CYCLES_PER_US = 16, PLANT_US = 100, FIFO = 1 << 16, RAM_START = 0x100, RAM_END = 0x8ff };
enum { PAINT = 0xc5 };

/* What a request may break; the second motor's bits are shifted by 4. */
enum { BROKEN_WIRE = 1, STALLED = 2, NOISE = 4, RESET = 0x100, HANG = 0x200, HELD = 0x400 };

typedef struct {
  uint32_t us;      /* let this time pass */
  uint32_t faults;  /* and while it does, these */
  float load[2];    /* part of each motor's speed that its load takes, 0..1 */
  uint32_t count;   /* of the bytes for the UART that follow */
  uint32_t program; /* and of those behind them: what the flash is to hold from its start; none: as it is */
} request_t;

typedef struct {
  double angle[2];   /* rad, forward positive */
  double speed[2];   /* rad/s */
  double us;         /* since power was first on */
  int32_t drive[2];  /* PWM -255..255; braking and coasting are 0 */
  uint32_t resets;   /* of the processor by its watchdog */
  uint32_t stack;    /* the most it ever used, bytes */
  uint32_t baud;     /* that the firmware set its UART to; 0 while that is off */
  uint32_t count;    /* of the bytes that follow */
} answer_t;

typedef struct {
  int encoder, enable, forward, backward; /* pins by their Arduino numbers */
  double pulses;                          /* a turn */
  double free;                            /* rad/s at full PWM without load */
  double dead;                            /* the PWM below which it does not turn */
  double lag, brake, coast;               /* time constants, s */
  double angle, speed;
  int drive;
  int level; /* of the encoder's pin */
} motor_t;

static struct {
  avr_t *avr;
  motor_t motor[2];
  uint32_t baud;
  uint32_t faults;
  float load[2];
  uint8_t in[FIFO], out[FIFO];
  uint32_t in_first, in_count, out_count;
  int xoff;
  uint32_t resets;
  int crashed; /* the processor does nothing more until it is reset */
} board;

/* ---- pins ---- */

typedef struct {
  uint16_t port, ddr;
  uint8_t bit;
} pin_t;

static pin_t pin_of(int arduino) {
  if (arduino < 8) return (pin_t){0x2b, 0x2a, (uint8_t)arduino};
  if (arduino < 14) return (pin_t){0x25, 0x24, (uint8_t)(arduino - 8)};
  return (pin_t){0x28, 0x27, (uint8_t)(arduino - 14)};
}

static int driven_high(int arduino) { /* an input is pulled low by the driver board */
  const pin_t pin = pin_of(arduino);
  return board.avr->data[pin.ddr] >> pin.bit & board.avr->data[pin.port] >> pin.bit & 1;
}

/* Which timer has a pin, if its output is connected (COM bits): OCR, and where the COM bits stand. */
static const struct {
  int arduino;
  uint16_t control, compare;
  uint8_t com;
} pwm_pins[] = {{6, 0x44, 0x47, 6},  {5, 0x44, 0x48, 4},  {9, 0x80, 0x88, 6},
                {10, 0x80, 0x8a, 4}, {11, 0xb0, 0xb3, 6}, {3, 0xb0, 0xb4, 4}};

static int duty(int arduino) {
  const pin_t pin = pin_of(arduino);
  if (!(board.avr->data[pin.ddr] >> pin.bit & 1)) return 0;
  for (size_t i = 0; i < sizeof pwm_pins / sizeof *pwm_pins; ++i) {
    if (pwm_pins[i].arduino != arduino) continue;
    if (board.avr->data[pwm_pins[i].control] >> pwm_pins[i].com & 2) return board.avr->data[pwm_pins[i].compare];
  }
  return driven_high(arduino) ? 255 : 0;
}

/* ---- motors and discs ---- */

static void set_encoder(motor_t *motor, int level) {
  if (motor->level == level) return;
  motor->level = level;
  /* Set as an outside pull, too: else a write to any pin of the port puts the inner pull-up in the place of the disc. */
  avr_ioport_external_t pulled = {.name = 'D'};
  for (int i = 0; i < 2; ++i) {
    pulled.mask |= 1u << board.motor[i].encoder;
    pulled.value |= (board.motor[i].level == 1) << board.motor[i].encoder;
  }
  avr_ioctl(board.avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('D'), &pulled);
  avr_raise_irq(avr_io_getirq(board.avr, AVR_IOCTL_IOPORT_GETIRQ('D'), motor->encoder), (uint32_t)level);
}

static void turn(motor_t *motor, uint32_t faults, double load, double dt) {
  const int enabled = duty(motor->enable);
  const int way = driven_high(motor->forward) - driven_high(motor->backward);
  double target = 0.0, lag = motor->coast;
  motor->drive = way * enabled;
  if (enabled && way) {
    const double above = (enabled - motor->dead) / (255.0 - motor->dead);
    if (above > 0.0) target = way * motor->free * fmax(0.0, above - load);
    lag = motor->lag;
  } else if (enabled) {
    lag = motor->brake;
  }
  if (faults & STALLED) motor->speed = target = 0.0;
  motor->speed += (target - motor->speed) * (1.0 - exp(-dt / lag));
  if (target == 0.0 && fabs(motor->speed) < 0.1) motor->speed = 0.0; /* friction has the last word */
  motor->angle += motor->speed * dt;
  if (faults & BROKEN_WIRE) {
    set_encoder(motor, 1); /* the pull-up */
  } else if (!(faults & NOISE)) {
    set_encoder(motor, (int64_t)floor(motor->angle / (2 * M_PI) * motor->pulses * 2 + 0.5) & 1);
  }
}

static avr_cycle_count_t plant(avr_t *avr, avr_cycle_count_t when, void *unused) {
  (void)avr, (void)unused;
  for (int i = 0; i < 2; ++i) turn(&board.motor[i], board.faults >> 4 * i & 0xf, board.load[i], PLANT_US * 1e-6);
  return when + PLANT_US * CYCLES_PER_US;
}

/* A loose wire that picks up so much that the processor does nothing but answer it. */
static avr_cycle_count_t noise(avr_t *avr, avr_cycle_count_t when, void *unused) {
  (void)avr, (void)unused;
  int noisy = 0;
  for (int i = 0; i < 2; ++i) {
    if (!(board.faults >> 4 * i & NOISE)) continue;
    noisy = 1;
    set_encoder(&board.motor[i], !board.motor[i].level);
  }
  return when + (noisy ? 40 : 1000 * CYCLES_PER_US);
}

/* ---- the serial line ---- */

/* What the firmware set its UART to, in baud; 0 while that is off. */
static double uart_baud(void) {
  const uint8_t *data = board.avr->data;
  if (!(data[0xc1] & 0x18)) return 0.0;
  return F_CPU_HZ / ((data[0xc0] & 2 ? 8.0 : 16.0) * ((data[0xc5] << 8 | data[0xc4]) + 1));
}

static uint8_t on_the_line(uint8_t byte) { /* at the wrong speed every byte is another one */
  return fabs(uart_baud() / board.baud - 1.0) < 0.04 ? byte : (uint8_t)(byte * 29 ^ 0xe6);
}

static void sent(avr_irq_t *irq, uint32_t value, void *unused) {
  (void)irq, (void)unused;
  if (board.out_count < FIFO) board.out[board.out_count++] = on_the_line((uint8_t)value);
}

static void flow(avr_irq_t *irq, uint32_t value, void *off) {
  (void)irq, (void)value;
  board.xoff = off != NULL;
}

static avr_cycle_count_t feed(avr_t *avr, avr_cycle_count_t when, void *unused) {
  (void)unused;
  if (board.in_count && (!board.xoff || board.faults & HELD)) {
    const uint8_t byte = board.in[board.in_first];
    board.in_first = (board.in_first + 1) % FIFO;
    --board.in_count;
    if (uart_baud() > 0.0 && !(board.faults & HELD))
      avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), on_the_line(byte));
  }
  return when + 10ull * F_CPU_HZ / board.baud;
}

/* ---- the processor ---- */

static void asleep(avr_t *avr, avr_cycle_count_t cycles) { (void)avr, (void)cycles; } /* nobody waits for real */

static void start_timers(void) { /* a reset forgets them */
  /* Else a disc that rests at low level is looked at in every cycle, long after the sketch enabled edges. */
  for (uint8_t i = 0; i < 2; ++i) avr_extint_set_strict_lvl_trig(board.avr, i, 0);
  avr_cycle_timer_register(board.avr, PLANT_US * CYCLES_PER_US, plant, NULL);
  avr_cycle_timer_register(board.avr, 10ull * F_CPU_HZ / board.baud, feed, NULL);
  avr_cycle_timer_register(board.avr, 1000 * CYCLES_PER_US, noise, NULL);
}

static void was_reset(avr_t *avr) {
  (void)avr;
  ++board.resets;
}

/* The reset button, or the DTR line. */
static void reset(void) {
  const uint32_t resets = board.resets;
  avr_reset(board.avr);
  board.resets = resets;
  board.crashed = 0;
  start_timers();
}

static uint32_t stack_used(void) {
  uint32_t lowest = RAM_END + 1;
  for (uint32_t at = RAM_END; at > RAM_START && lowest - at < 64; --at) /* 64 untouched bytes end it */
    if (board.avr->data[at] != PAINT) lowest = at;
  return RAM_END + 1 - lowest;
}

static void pass(uint32_t us) {
  const avr_cycle_count_t end = board.avr->cycle + (avr_cycle_count_t)us * CYCLES_PER_US;
  while (board.avr->cycle < end) {
    if (board.faults & HELD || board.crashed) {
      board.avr->cycle += 16;
      avr_cycle_timer_process(board.avr);
      continue;
    }
    const uint32_t resets = board.resets;
    const int state = avr_run(board.avr);
    board.crashed = state == cpu_Done || state == cpu_Crashed;
    if (board.crashed) fprintf(stderr, "the firmware crashed at %#x\n", board.avr->pc);
    if (board.resets != resets) start_timers();
  }
}

/* The program loses itself: an endless loop with interrupts off, such as every C runtime ends with. */
static void hang(void) {
  for (uint32_t at = 0; at + 1 < board.avr->codeend; at += 2) {
    if (board.avr->flash[at] != 0xff || board.avr->flash[at + 1] != 0xcf) continue; /* rjmp to itself */
    board.avr->pc = at;
    board.avr->sreg[S_I] = 0;
    board.avr->state = cpu_Running;
    return;
  }
}

static void quiet(avr_t *avr, const int level, const char *format, va_list arguments) {
  (void)avr;
  if (level <= LOG_ERROR) vfprintf(stderr, format, arguments);
}

static void connect_uart(void) {
  const uint32_t uart = AVR_IOCTL_UART_GETIRQ('0');
  uint32_t flags = 0;
  avr_ioctl(board.avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags); /* neither echo nor real sleep */
  avr_irq_register_notify(avr_io_getirq(board.avr, uart, UART_IRQ_OUTPUT), sent, NULL);
  avr_irq_register_notify(avr_io_getirq(board.avr, uart, UART_IRQ_OUT_XON), flow, NULL);
  avr_irq_register_notify(avr_io_getirq(board.avr, uart, UART_IRQ_OUT_XOFF), flow, &board);
}

static int make_board(void) {
  board.avr = avr_make_mcu_by_name("atmega328p");
  if (!board.avr) return 0;
  board.avr->frequency = F_CPU_HZ;
  avr_init(board.avr);
  board.avr->sleep = asleep;
  board.avr->reset = was_reset;
  memset(board.avr->data + RAM_START, PAINT, RAM_END + 1 - RAM_START);
  connect_uart();
  start_timers();
  return 1;
}

static int make_motor(motor_t *motor, const char *text) {
  motor->level = -1;
  return sscanf(text, "%d,%d,%d,%d,%lf,%lf,%lf,%lf,%lf,%lf", &motor->encoder, &motor->enable, &motor->forward,
                &motor->backward, &motor->pulses, &motor->free, &motor->dead, &motor->lag, &motor->brake,
                &motor->coast) == 10;
}

static int take(const request_t *request) {
  if (request->count > FIFO - board.in_count) return 0;
  for (uint32_t i = 0; i < request->count; ++i) {
    const int byte = getchar();
    if (byte == EOF) return 0;
    board.in[(board.in_first + board.in_count++) % FIFO] = (uint8_t)byte;
  }
  if (request->program > board.avr->flashend + 1) return 0;
  if (request->program) {
    if (fread(board.avr->flash, 1, request->program, stdin) != request->program) return 0;
    board.avr->codeend = request->program;
  }
  board.faults = request->faults;
  memcpy(board.load, request->load, sizeof board.load);
  if (request->faults & RESET) reset();
  if (request->faults & HANG) hang();
  return 1;
}

static int give(void) {
  answer_t answer = {.us = (double)board.avr->cycle / CYCLES_PER_US, .resets = board.resets, .stack = stack_used()};
  answer.baud = (uint32_t)(uart_baud() + 0.5);
  for (int i = 0; i < 2; ++i) {
    answer.angle[i] = board.motor[i].angle;
    answer.speed[i] = board.motor[i].speed;
    answer.drive[i] = board.motor[i].drive;
  }
  answer.count = board.out_count;
  board.out_count = 0;
  return fwrite(&answer, sizeof answer, 1, stdout) == 1 && fwrite(board.out, 1, answer.count, stdout) == answer.count &&
         !fflush(stdout);
}

int main(int count, char **arguments) {
  avr_global_logger_set(quiet);
  if (count != 4 || !make_motor(&board.motor[0], arguments[2]) || !make_motor(&board.motor[1], arguments[3])) {
    fprintf(stderr, "usage: uno BAUD MOTOR MOTOR\n");
    return 2;
  }
  board.baud = (uint32_t)strtoul(arguments[1], NULL, 10);
  if (!make_board()) return 1;
  request_t request;
  while (fread(&request, sizeof request, 1, stdin) == 1) {
    if (!take(&request)) return 1;
    pass(request.us);
    if (!give()) return 1;
  }
  return 0;
}
