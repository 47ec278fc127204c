"""An STM32F405 for the unmodified images of the product, on the emulator `unicorn`.

The processor is emulated; what is around it is modelled here at the level of registers: reset and clock control,
ports, timers 1, 2 and 5, the serial line with DMA, the independent watchdog, the converter, the SPI, the backup
registers, the flash controller. A peripheral whose clock is off reads as zero and takes nothing. Pins act only in the
mode that they are set to. While a sector of flash is erased the processor stands still, and the rest goes on.

Time moves where the program waits: at a reading of TIM2 (the loop's clock), at a conversion, and while it polls a
flag. Between two events of the outside world the loop has nothing to do, so a reading of TIM2 moves the time to the
next event, at most `TURN_US` on. Instructions between take no time.
"""

import os
import random
import struct

from elftools.elf.elffile import ELFFile
from unicorn import UC_ARCH_ARM, UC_HOOK_CODE, UC_HOOK_MEM_READ, UC_HOOK_MEM_WRITE, UC_MODE_MCLASS, UC_MODE_THUMB, Uc, UcError
from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_PC, UC_ARM_REG_SP, UC_ARM_REG_XPSR, UC_CPU_ARM_CORTEX_M4

FLASH, FLASH_LEN = 0x0800_0000, 0x10_0000
TABLE, TABLE_LEN = 0x080E_0000, 0x2_0000
RAM, RAM_LEN = 0x2000_0000, 0x2_0000
BUS, BITS = 0x4000_0000, 0x4200_0000
TIM2, TIM5, RTC_BKP0, IWDG, USART2, PWR = 0x40000000, 0x40000C00, 0x40002850, 0x40003000, 0x40004400, 0x40007000
TIM1, ADC1, SPI1, GPIOA, GPIOB, RCC = 0x40010000, 0x40012000, 0x40013000, 0x40020000, 0x40020400, 0x40023800
DMA1, FLASHC = 0x40026000, 0x40023C00
# Stream 5: control, items left, addresses of the peripheral and of the memory.
S5CR, S5NDTR, S5PAR, S5M0AR = DMA1 + 0x88, DMA1 + 0x8C, DMA1 + 0x90, DMA1 + 0x94
UID = 0x1FFF7A10
CRYSTAL_HZ, INTERNAL_HZ, LSI_HZ = 25e6, 16e6, 32e3
# Registers with a meaning after a reset.
AT_RESET = {RCC: 0x83, RCC + 4: 0x24003010, GPIOA: 0xA8000000, GPIOB: 0x280, TIM1 + 0x2C: 0xFFFF, TIM2 + 0x2C: 0xFFFFFFFF}
# Where the clock of a peripheral is switched on: register and bit.
CLOCKED = {
    GPIOA: (RCC + 0x30, 0), GPIOB: (RCC + 0x30, 1), TIM2: (RCC + 0x40, 0), TIM5: (RCC + 0x40, 3),
    USART2: (RCC + 0x40, 17), PWR: (RCC + 0x40, 28), TIM1: (RCC + 0x44, 0), ADC1: (RCC + 0x44, 8),
    SPI1: (RCC + 0x44, 12), DMA1: (RCC + 0x30, 21),
}
# The sectors of the flash: start, length, the longest time to erase one at 3.3 V by 32 bits in s (data sheet).
SECTORS = [(n << 14, 1 << 14, 0.5) for n in range(4)] + [(1 << 16, 1 << 16, 1.1)]
SECTORS += [(n << 17, 1 << 17, 2.0) for n in range(1, 8)]
WORD_US = 16.0
FLASH_KEYS = [0x45670123, 0xCDEF89AB]
BYTE_US = 1e7 / 115200
# Causes of a reset, as RCC's CSR shows them.
POWER_ON, WATCHDOG = 0x0E000000, 0x24000000
TURN_US = 1000.0
# What memory holds that was never written.
PAINT = b"\xcc"
INSTRUCTIONS = 4_000_000
POLLS = 600_000
NMI, HARD_FAULT = 2, 3
# An instruction that jumps to itself, where no program is.
HANG = 0x1FFE_0000
NEVER = float("inf")


class Board:
    """One controller and what is wired to it."""

    def __init__(self, elf, table, mains, uid, crystal=True, car="C", chip=None, internal_error=0.006):
        self.mains, self.car, self.chip = mains, car, chip
        self.image = os.path.splitext(os.path.basename(elf))[0]
        # The host knows the shipped tables, a crystal that runs, and captures.
        self.repeatable = table is None and crystal and "ade7953" not in self.image
        self.crystal, self.internal_error = crystal, internal_error
        self.flash = bytearray(b"\xff" * FLASH_LEN)
        file = ELFFile(open(elf, "rb"))
        # The variables' end: what lies above it is stack.
        self.symbols = file.get_section_by_name(".symtab")
        self.variables_end = self.symbols.get_symbol_by_name("__euninit")[0]["st_value"]
        for segment in file.iter_segments():
            if segment["p_type"] == "PT_LOAD" and segment["p_filesz"]:
                at = segment["p_paddr"] - FLASH
                self.flash[at:at + segment["p_filesz"]] = segment.data()
        if table is not None:
            self.flash[TABLE - FLASH:] = table.ljust(TABLE_LEN, b"\xff")
        self.uid = uid
        self.ram = PAINT * RAM_LEN
        self.backup = 0
        self.us = 0.0
        # What was seen from outside, with its time in seconds.
        self.coil, self.pilot, self.line, self.resets = [], [], [], []
        self.stamps = []
        # What the program asked of the outside and was told, for the host to repeat: (kind, value).
        self.tape = None
        self.gap_us = self.long_gap_us = 0.0
        # What comes on PA3: (moment in us, byte).
        self.coming = []
        # Steps of the flash: what was done when; after how many more the supply fails, and the dice for what is left.
        self.steps, self.cut_after, self.dice = [], None, random.Random(16)
        self.events = []
        self.order = []
        # What stops the program where it comes to: (hook, first address, last one, how).
        self.trap = None
        self.power_up(POWER_ON)

    # -- start and stop

    def power_up(self, cause):
        """A reset: registers lose what they held, pins float, memory and backup registers stay."""
        self.cause = cause
        self.resets.append((self.us * 1e-6, cause))
        self.regs = dict(AT_RESET)
        self.counters = {}
        self.moder = {GPIOA: 0xA8000000, GPIOB: 0x280}
        self.capture, self.status = 0, 0
        self.fed_us = None
        self.sent_us = 0.0
        self.byte = bytearray()
        self.converted = self.polls = 0
        self.cut, self.halting = None, False
        self.dog_open, self.dog_period_us = False, 0.0
        self.locked, self.keys, self.busy_us, self.flash_flags, self.fixes = True, [], 0.0, 0, []
        self.ring, self.left, self.taken = 0, 0, 0
        self.supply = True
        self.received = []
        self.selected = False
        self.tape = []
        self.looping = False
        self.pending = self.jumped = None
        self.uc = uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M4)
        uc.mem_map(FLASH, FLASH_LEN)
        uc.mem_write(FLASH, bytes(self.flash))
        uc.mem_map(RAM, RAM_LEN)
        uc.mem_write(RAM, self.ram)
        uc.mem_map(UID & ~0xFFF, 0x1000)
        uc.mem_write(UID, self.uid)
        uc.mem_map(0xE000E000, 0x1000)
        uc.mem_map(HANG, 0x1000)
        uc.mem_write(HANG, b"\xfe\xe7")
        uc.mmio_map(BUS, 0x80000, self.read, None, self.write, None)
        uc.mmio_map(BITS, 0x1000000, self.read_bit, None, self.write_bit, None)
        uc.hook_add(UC_HOOK_MEM_WRITE, self.program, None, FLASH, FLASH + FLASH_LEN - 1)
        self.set_trap()
        sp, self.pc = struct.unpack("<II", uc.mem_read(FLASH, 8))
        uc.reg_write(UC_ARM_REG_SP, sp)
        self.see_outputs()

    def run(self, until_s):
        """Runs to this moment, through whatever resets happen."""
        self.until_us = until_s * 1e6
        while self.us < self.until_us:
            before = self.us
            try:
                self.uc.emu_start(self.pc | 1, 0, count=INSTRUCTIONS)
                self.pc = self.uc.reg_read(UC_ARM_REG_PC)
            except UcError:
                # An address or an instruction that cannot be. A fault in a fault stops the core.
                self.pc = self.uc.reg_read(UC_ARM_REG_PC)
                self.pending = HARD_FAULT
            if self.jumped is not None:
                self.pc, self.jumped = self.jumped, None
            if self.pending is not None:
                self.enter(self.pending)
                self.pending = None
            if self.us == before and self.us < self.until_us and self.supply:
                # It waits for nothing that is modelled: it loops or sleeps.
                self.us += 10_000.0
            if not self.supply:
                # It comes back: memory and backup registers are lost.
                self.us += 200_000.0
                self.ram, self.backup = PAINT * RAM_LEN, 0
                self.coming.clear()
                self.power_up(POWER_ON)
            elif self.bitten():
                self.ram = bytes(self.uc.mem_read(RAM, RAM_LEN))
                self.power_up(WATCHDOG)

    def hang(self):
        """The program goes on at an instruction that jumps to itself."""
        self.pc = HANG

    def jump(self, address):
        """The same at an address, from within an event."""
        self.jumped = address
        self.uc.emu_stop()

    def address(self, name):
        """Address of the function with this in its mangled name, which must be one."""
        found = {s["st_value"] & ~1 for s in self.symbols.iter_symbols() if name in s.name and s["st_value"]}
        if len(found) != 1:
            raise LookupError(f"{len(found)} functions are called {name}")
        return found.pop()

    def stops_reading(self, start, length, how):
        """From the next start on the program is stopped where it reads this part of the flash."""
        self.trap = (UC_HOOK_MEM_READ, FLASH + start, FLASH + start + length - 1, how)

    def stops_calling(self, name, how):
        """From the next start on the program is stopped where it calls this function."""
        self.trap = (UC_HOOK_CODE, self.address(name), self.address(name), how)

    def set_trap(self):
        if self.trap:
            hook, first, last, how = self.trap
            self.uc.hook_add(hook, self.trapped, how, first, last)

    def trapped(self, *seen):
        """By a panic, by a fault of the bus, or for ever."""
        how = seen[-1]
        if how == "fault":
            self.pending = HARD_FAULT
            self.uc.emu_stop()
        else:
            self.jump(HANG if how == "hang" else self.address("rust_begin_unwind"))

    def enter(self, number):
        """Starts an exception. None of them comes back in these programs."""
        sp = self.uc.reg_read(UC_ARM_REG_SP) - 32
        self.uc.mem_write(sp, struct.pack("<8I", 0, 0, 0, 0, 0, 0, self.pc, 1 << 24))
        self.uc.reg_write(UC_ARM_REG_SP, sp)
        self.uc.reg_write(UC_ARM_REG_LR, 0xFFFFFFF9)
        self.pc = struct.unpack("<I", self.flash[4 * number:4 * number + 4])[0] & ~1

    def stack(self):
        """Bytes of stack that were ever written since the supply came."""
        start = self.variables_end - RAM
        used = bytes(self.uc.mem_read(RAM + start, RAM_LEN - start))
        return len(used.lstrip(PAINT))

    def bitten(self):
        return self.fed_us is not None and self.us - self.fed_us > self.dog_period_us

    def dog_us(self):
        prescaler, reload = self.regs.get(IWDG + 4, 0), self.regs.get(IWDG + 8, 0xFFF)
        return (reload + 1) * (4 << (prescaler & 7)) / LSI_HZ * 1e6

    # -- time

    def advance(self, us):
        """The outside world for so long."""
        self.us += us
        t = self.us * 1e-6
        while self.mains.next_s <= t:
            self.cross(self.mains.next_s)
            self.mains.cross()
        while self.coming and self.coming[0][0] <= self.us:
            self.arrive(self.coming.pop(0)[1])
        while self.events and self.events[0][0] <= t:
            self.events.pop(0)[1](self)
        self.halting = self.us >= self.until_us or self.bitten() or self.pending is not None or not self.supply
        if self.halting:
            self.uc.emu_stop()

    def turn(self):
        """The loop asks for the time: nothing to do until the next event."""
        now = self.us
        until = min(self.mains.next_s * 1e6, now + TURN_US)
        if self.events:
            until = min(until, self.events[0][0] * 1e6)
        if self.coming:
            until = min(until, self.coming[0][0])
        if self.sent_us > now:
            until = min(until, self.sent_us)
        self.advance(max(until - now, 2.0))

    def tree(self):
        """Core clock in Hz as the registers say and as it is, and the timers' by bus."""
        cr, pll, cfgr = self.regs[RCC], self.regs[RCC + 4], self.regs.get(RCC + 8, 0)
        crystal = self.crystal and cr >> 16 & 1
        inner = INTERNAL_HZ * (1 + self.internal_error)
        source = {0: inner, 1: CRYSTAL_HZ if crystal else 0.0}.get(cfgr & 3)
        if source is None:
            source = (CRYSTAL_HZ if crystal else 0.0) if pll >> 22 & 1 else inner
            source = source / (pll & 63) * (pll >> 6 & 511) / (2 * (pll >> 16 & 3) + 2) if cr >> 24 & 1 else 0.0
        buses = []
        for shift in (10, 13):
            bits = cfgr >> shift & 7
            divider = 1 << (bits - 3) if bits & 4 else 1
            buses.append((source / divider, source if divider == 1 else 2 * source / divider))
        return source, buses

    def retime(self):
        """The clock tree or a prescaler has changed: timers count on from where they are."""
        _, (first, second) = self.tree()
        for timer, (_, hz) in ((TIM2, first), (TIM5, first), (TIM1, second)):
            hz /= self.regs.get(timer + 0x28, 0) + 1
            self.counters[timer] = (self.us, self.count(timer, self.us), hz)

    def count(self, timer, us):
        since, count, hz = self.counters.get(timer, (us, 0.0, 0.0))
        running = self.regs.get(timer, 0) & 1
        return count + (us - since) * 1e-6 * hz * running

    CLOCK = TIM2

    def move_clock(self, us):
        """The loop's counter jumps ahead, as if the time had passed unseen."""
        since, count, hz = self.counters[TIM2]
        self.counters[TIM2] = since, count + us, hz

    def cross(self, at_s):
        """A zero crossing on PA0."""
        if self.regs.get(TIM5 + 0x20, 0) & 1 and self.on(TIM5) and self.mode(GPIOA, 0) == 2:
            self.status |= 1 << 9 if self.status & 2 else 0
            self.status |= 2
            self.capture = int(self.count(TIM5, at_s * 1e6)) & 0xFFFFFFFF

    def fail_crystal(self):
        """The crystal stops. With the security system on, the core clock falls back and the core is told."""
        self.crystal = False
        if self.regs[RCC] >> 19 & 1:
            self.regs[RCC] &= ~(1 << 16 | 1 << 24)
            self.regs[RCC + 8] = self.regs.get(RCC + 8, 0) & ~3
            self.pending = NMI
        self.retime()
        self.see_outputs()

    # -- the flash

    def step(self, what, at, length, good):
        """A step of the flash; `good` is what it leaves, unless the supply fails in it."""
        self.steps.append((self.us * 1e-6, what, at))
        if self.cut_after is not None:
            self.cut_after -= 1
            if self.cut_after < 0:
                self.cut_after, self.supply = None, False
                good = self.torn(what, at, length, good)
        self.flash[at:at + length] = good
        self.fixes.append((at, bytes(good)))
        if not self.supply:
            self.halting = True
            self.uc.emu_stop()

    def torn(self, what, at, length, good):
        """What a step leaves in which the supply fails: as it was, as it should be, or anything between."""
        old, way = self.flash[at:at + length], self.dice.randrange(3)
        if way < 2:
            return good if way else old
        if what == "erase":
            return self.dice.randbytes(length)
        return bytes(new | was & self.dice.randrange(256) for was, new in zip(old, good))

    def program(self, _uc, _access, address, size, value, _data):
        """The processor writes to the flash: a word where the controller is open for words, else a fault flag."""
        at = address - FLASH
        old = bytes(self.flash[at:at + size])
        control = self.regs.get(FLASHC + 0x10, 0)
        if self.locked or not control & 1 or size != 4 or control >> 8 & 3 != 2 or at % 4:
            self.flash_flags |= 1 << 7
            self.fixes.append((at, old))
            return
        word = struct.unpack("<I", old)[0] & value & 0xFFFFFFFF
        self.busy_us = self.us + WORD_US
        self.step("write", at, 4, struct.pack("<I", word))

    def order_flash(self, value):
        """A word for the controller's CR."""
        if self.locked:
            return
        self.regs[FLASHC + 0x10] = value & ~(1 << 16)
        self.locked = bool(value >> 31)
        if value >> 16 & 1 and value & 2:
            start, length, seconds = SECTORS[value >> 3 & 15]
            self.busy_us = self.us + seconds * 1e6
            self.step("erase", start, length, b"\xff" * length)

    def flash_status(self):
        """SR; whoever waits stands still until the controller is done."""
        for at, good in self.fixes:
            self.uc.mem_write(FLASH + at, good)
        self.fixes.clear()
        if self.us < self.busy_us and self.supply:
            self.advance(self.busy_us - self.us)
        return self.flash_flags

    # -- what comes on the line

    def hear(self, data, at_s=None):
        """Bytes for PA3, one after the other from this moment on."""
        at = max(self.us if at_s is None else at_s * 1e6, self.coming[-1][0] if self.coming else 0.0)
        self.coming += [(at + BYTE_US * (n + 1), byte) for n, byte in enumerate(data)]

    def arrive(self, byte):
        """A byte is whole: DMA puts it into the ring, if pin, receiver and stream are set up."""
        _, ((bus, _), _) = self.tree()
        right = abs(bus / max(self.regs.get(USART2 + 8, 0), 1) / 115200 - 1) < 0.02
        receives = self.regs.get(USART2 + 0xC, 0) & 0x2004 == 0x2004 and self.regs.get(USART2 + 0x14, 0) >> 6 & 1
        pin = self.mode(GPIOA, 3) == 2 and self.regs.get(GPIOA + 0x20, 0) >> 12 & 15 == 7
        control = self.regs.get(S5CR, 0)
        serves = control & 1 and control >> 25 & 7 == 4 and self.regs.get(S5PAR, 0) == USART2 + 4
        if not (receives and pin and serves and self.on(DMA1) and self.on(USART2)):
            return
        place = self.regs.get(S5M0AR, 0) + self.ring - self.left
        self.uc.mem_write(place, bytes([byte if right else byte ^ 0x55]))
        self.left = self.left - 1 or (self.ring if control >> 8 & 1 else 0)

    def heard(self):
        """NDTR; with the byte that the program reads next, for the tape."""
        word = self.left
        if self.ring and self.taken != (self.ring - self.left) % self.ring:
            byte = self.uc.mem_read(self.regs.get(S5M0AR, 0) + self.taken, 1)[0]
            self.taken = (self.taken + 1) % self.ring
            word |= byte << 16
        self.told(b"D", word)
        return self.left

    # -- pins

    def on(self, block):
        register, bit = CLOCKED[block]
        return self.regs.get(register, 0) >> bit & 1

    def mode(self, port, pin):
        return self.moder[port] >> 2 * pin & 3

    def see_outputs(self):
        """Notes contactor and pilot when they change."""
        t = self.us * 1e-6
        closed = self.mode(GPIOB, 0) == 1 and bool(self.regs.get(GPIOB + 0x14, 0) & 1)
        if not self.coil or self.coil[-1][1] != closed:
            self.coil.append((t, closed))
        line = self.pilot_line()
        if not self.pilot or self.pilot[-1][1] != line:
            self.pilot.append((t, line))

    def pilot_line(self):
        """PA8: None while it floats, or frequency in Hz and share of the period for which it is high."""
        regs = self.regs
        alternate = self.mode(GPIOA, 8) == 2 and regs.get(GPIOA + 0x24, 0) & 15 == 1
        driven = regs.get(TIM1, 0) & 1 and regs.get(TIM1 + 0x20, 0) & 1 and regs.get(TIM1 + 0x44, 0) >> 14 & 3
        if not (alternate and driven):
            return None
        _, (_, (_, hz)) = self.tree()
        steps = regs.get(TIM1 + 0x2C, 0xFFFF) + 1
        high = min(regs.get(TIM1 + 0x34, 0) / steps, 1.0)
        return (round(hz / (regs.get(TIM1 + 0x28, 0) + 1) / steps, 3), high)

    def pilot_volt(self):
        """The pilot at this moment, as the car loads it."""
        upper = {"A": 12.0, "B": 9.0, "C": 6.0, "D": 3.0, "E": 0.0, "F": -12.0}[self.car]
        line = self.pilot[-1][1]
        if line is None or line[1] >= 1.0:
            return upper
        return upper if (self.us * 1e-6 * line[0]) % 1.0 < line[1] else -12.0

    # -- registers

    def read_bit(self, _uc, offset, _size, _data):
        return self.load(BUS + (offset >> 7 << 2)) >> (offset >> 2 & 31) & 1

    def write_bit(self, _uc, offset, _size, value, _data):
        word, bit = BUS + (offset >> 7 << 2), offset >> 2 & 31
        self.store(word, self.regs.get(word, 0) & ~(1 << bit) | (value & 1) << bit)

    def read(self, _uc, offset, size, _data):
        word = self.load(BUS + (offset & ~3))
        return word >> 8 * (offset & 3) & ((1 << 8 * size) - 1)

    def write(self, _uc, offset, size, value, _data):
        word = BUS + (offset & ~3)
        if size < 4:
            shift = 8 * (offset & 3)
            mask = (1 << 8 * size) - 1 << shift
            value = self.regs.get(word, 0) & ~mask | value << shift & mask
        self.store(word, value)

    def told(self, kind, value):
        if self.looping:
            self.tape.append((kind, value))
        return value

    def load(self, word):
        if word == TIM2 + 0x24:
            # The emulator does an instruction again in which it was stopped: the same reading, not another.
            if self.cut is None:
                self.looping = True
                self.turn()
                now = self.told(b"T", int(self.count(TIM2, self.us)) & 0xFFFFFFFF)
                self.cut = now if self.halting else None
                return now
            now, self.cut = self.cut, None
            return now
        self.cut = None
        if word == TIM5 + 0x10:
            return self.told(b"S", self.status) if self.on(TIM5) else 0
        if word == TIM5 + 0x34:
            self.status &= ~2
            self.stamps.append((self.us, self.capture))
            return self.told(b"C", self.capture)
        if word == USART2:
            return self.told(b"U", 0xC0 if self.us >= self.sent_us else 0) if self.on(USART2) else 0
        if word == ADC1:
            return 2
        if word == ADC1 + 0x4C:
            return self.told(b"A", self.converted) if self.on(ADC1) else 0
        if word == S5NDTR:
            return self.heard() if self.on(DMA1) else 0
        if word == FLASHC + 0xC:
            return self.flash_status()
        if word == FLASHC + 0x10:
            return self.regs.get(word, 0) & ~(1 << 31) | self.locked << 31
        if word == RCC:
            # A turn of a loop that polls a flag: eight cycles. One that polls for ever is let go on faster.
            self.polls += 1
            self.advance(0.1 if self.polls < POLLS else 1000.0)
            cr = self.regs[RCC]
            ready = (cr & 1) << 1 | (cr >> 16 & 1 and self.crystal) << 17 | (cr >> 24 & 1) << 25
            return cr | ready
        if word == RCC + 8:
            return self.regs.get(word, 0) & ~12 | (self.regs.get(word, 0) & 3) << 2
        if word == RCC + 0x74:
            return self.cause | self.regs.get(word, 0) & 3
        if word == PWR + 4:
            return 0x4000
        if word == RTC_BKP0:
            return self.backup
        if word == SPI1 + 8:
            return 2 | bool(self.received)
        if word == SPI1 + 0xC:
            return self.received.pop(0) if self.received else 0
        if word in (IWDG, IWDG + 0xC):
            return 0
        return self.regs.get(word, 0)

    def store(self, word, value):
        block = word & ~0x3FF
        if block in CLOCKED and not self.on(block):
            return
        if word == RCC:
            # What is ready is the hardware's to say.
            value &= ~(1 << 1 | 1 << 17 | 1 << 25)
            if value >> 16 & 1 and "crystal" not in self.order:
                self.order.append("crystal")
        elif word == RCC + 0x74:
            if value >> 24 & 1:
                self.cause = 0
        elif word == IWDG:
            key = value & 0xFFFF
            self.dog_open = key == 0x5555
            if key == 0xCCCC or key == 0xAAAA and self.fed_us is not None:
                if self.fed_us is not None:
                    gap = self.us - self.fed_us
                    # Apart: what passes while it has more time than usual.
                    if self.dog_period_us < 1e6:
                        self.gap_us = max(self.gap_us, gap)
                    else:
                        self.long_gap_us = max(self.long_gap_us, gap)
                else:
                    self.order.append("watchdog")
                self.fed_us, self.dog_period_us = self.us, self.dog_us()
            return
        elif word in (IWDG + 4, IWDG + 8) and not self.dog_open:
            return
        elif word == FLASHC + 4:
            self.keys.append(value)
            if self.keys[-2:] == FLASH_KEYS:
                self.locked = False
            return
        elif word == FLASHC + 0xC:
            self.flash_flags &= ~value
            return
        elif word == FLASHC + 0x10:
            self.order_flash(value)
            return
        elif word == S5NDTR:
            self.ring = self.left = value & 0xFFFF
            self.taken = 0
            return
        elif word == RTC_BKP0:
            if self.on(PWR) and self.regs.get(PWR, 0) >> 8 & 1:
                self.backup = value
            return
        elif word == TIM5 + 0x10:
            self.status &= value
            return
        elif word == USART2 + 4:
            self.transmit(value & 0xFF)
            return
        elif word == ADC1 + 8:
            if value >> 30 & 1:
                self.convert()
                value &= ~(1 << 30)
        elif word == SPI1 + 0xC:
            if self.regs.get(SPI1, 0) >> 6 & 1:
                self.received.append(self.chip.exchange(value & 0xFF) if self.chip and self.selected else 0xFF)
            return
        elif word in (GPIOA + 0x18, GPIOB + 0x18):
            word -= 4
            value = self.regs.get(word, 0) & ~(value >> 16) | value & 0xFFFF
        if word in (GPIOA, GPIOB):
            self.moder[word] = value
        if word == TIM2 + 0x14 or word == TIM5 + 0x14:
            self.counters[block] = (self.us, 0.0, self.counters.get(block, (0, 0, 0.0))[2])
        if word in (TIM2, TIM5, TIM1) and block in self.counters:
            since = self.counters[block]
            self.counters[block] = (self.us, self.count(block, self.us), since[2])
        self.regs[word] = value
        if block == RCC or word & 0x3FF == 0x28 and block in (TIM1, TIM2, TIM5):
            self.retime()
        if block in (GPIOA, GPIOB, TIM1):
            self.see_outputs()
            self.select()

    def select(self):
        """PA4, the metering chip's select, which is active low."""
        selected = self.mode(GPIOA, 4) == 1 and not self.regs.get(GPIOA + 0x14, 0) >> 4 & 1
        if selected != self.selected:
            self.selected = selected
            if self.chip:
                self.chip.select(selected, self.us * 1e-6)

    def transmit(self, byte):
        """A byte to the serial line; noise unless the line's rate is 115 200 baud within 2 %."""
        _, ((bus, _), _) = self.tree()
        baud = bus / max(self.regs.get(USART2 + 8, 0), 1)
        self.sent_us = self.us + 1e7 / max(baud, 1.0)
        if self.looping:
            self.tape.append((b"B", byte))
        driven = self.mode(GPIOA, 2) == 2 and self.regs.get(GPIOA + 0x20, 0) >> 8 & 15 == 7
        self.byte.append(byte if driven and abs(baud / 115200 - 1) < 0.02 else byte ^ 0x55)
        if byte == 0:
            self.line.append((self.us * 1e-6, bytes(self.byte)))
            self.byte.clear()

    def convert(self):
        """One conversion of PA1: 68 cycles of a quarter of the bus clock."""
        _, (_, (bus, _)) = self.tree()
        self.advance(68e6 * 4 / max(bus, 1.0))
        right = self.regs.get(ADC1 + 8, 0) & 1 and self.regs.get(ADC1 + 0x34, 0) & 31 == 1 and self.mode(GPIOA, 1) == 3
        volt = 1.65 + self.pilot_volt() / 8 if right else 0.0
        self.converted = min(max(int(volt / 3.3 * 4096), 0), 4095)
