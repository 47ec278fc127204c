"""The mains at the charger's terminals, and the grid behind it.

The plant is that of the paper: x' of f, g, l, p in Hz and GW. The whole fleet follows the participation that this one
charger states in its telemetry.
"""

import random

GOVERNOR_GAIN, GOVERNOR_S, TURBINE_S, LEAD_S, LAG_S, DAMPING, INERTIA = -5.0, 2.5, 0.5, 2.0, 12.0, 1.0, 4.0
STEP_S = 0.005


class Mains:
    """Positive-going zero crossings of a mains whose frequency is a function of time."""

    def __init__(self, hz=lambda t: 50.0, jitter_us=0.0, steps=(), dark=()):
        """`steps`: (moment in s, degrees by which the phase jumps). `dark`: (from, to) without mains."""
        self.hz, self.jitter_us, self.dark = hz, jitter_us, dark
        self.steps = list(steps)
        self.noise = random.Random(16)
        self.ideal_s = 0.0137
        self.next_s = self.ideal_s
        self.period_s = 0.02
        self.skip()

    def cross(self):
        """The crossing at `next_s` is over: the next one."""
        before = self.ideal_s
        period = 1.0 / self.hz(self.ideal_s)
        self.ideal_s += period
        while self.steps and self.steps[0][0] <= self.ideal_s:
            self.ideal_s += self.steps.pop(0)[1] / 360.0 * period
        # What a chip measures from crossing to crossing.
        self.period_s = self.ideal_s - before
        self.skip()
        self.next_s = self.ideal_s + self.noise.uniform(-1, 1) * self.jitter_us * 1e-6

    def skip(self):
        for start, end in self.dark:
            if start <= self.ideal_s < end:
                self.ideal_s = end
                self.next_s = end


class Grid:
    """The plant, hit by a loss of `loss_gw` from `from_s` until `to_s`."""

    def __init__(self, fleet_gw, loss_gw, from_s, to_s=float("inf")):
        self.fleet_gw, self.loss_gw, self.from_s, self.to_s = fleet_gw, loss_gw, from_s, to_s
        self.x, self.t = (0.0, 0.0, 0.0, 0.0), 0.0
        self.participation = 0.0
        self.trace = []

    def slope(self, x, loss):
        f, g, l, p = x
        fall = (GOVERNOR_GAIN * f - g) / GOVERNOR_S
        balance = p + self.fleet_gw * self.participation - loss - DAMPING * f
        return balance / (2 * INERTIA), fall, (g + LEAD_S * fall - l) / LAG_S, (l - p) / TURBINE_S

    def hz(self, t):
        while self.t < t:
            loss = self.loss_gw if self.from_s <= self.t < self.to_s else 0.0
            half = self.slope(self.x, loss)
            middle = tuple(x + STEP_S / 2 * d for x, d in zip(self.x, half))
            self.x = tuple(x + STEP_S * d for x, d in zip(self.x, self.slope(middle, loss)))
            self.t += STEP_S
            self.trace.append((self.t, self.x[0]))
        return 50.0 + self.x[0]


class Chip:
    """An ADE7953 on the SPI, mode 3: PERIOD, the required setting, and what was sent last."""

    def __init__(self, mains):
        self.mains, self.frame, self.required, self.unlocked, self.last = mains, [], 0, False, 0
        self.at_s, self.flip, self.value = 0.0, 0, 0

    def select(self, selected, at_s):
        self.at_s = at_s
        if not selected and len(self.frame) >= 4 and self.frame[2] == 0:
            address = self.frame[0] << 8 | self.frame[1]
            if address == 0xFE:
                self.unlocked = self.frame[3] == 0xAD
            elif address == 0x120 and self.unlocked and len(self.frame) == 5:
                self.required, self.unlocked = self.frame[3] << 8 | self.frame[4], False
        self.frame = []

    def register(self, address):
        if address == 0x10E:
            period = self.mains.period_s if self.required == 0x30 else 0.0
            value = max(int(223750 * period) - 1, 0)
        else:
            value = {0x120: self.required, 0x1FF: self.last}.get(address, 0)
        if address != 0x1FF:
            self.last = value
        return value

    def exchange(self, byte):
        self.frame.append(byte)
        n = len(self.frame)
        if n == 4 and self.frame[2] == 0x80:
            address = self.frame[0] << 8 | self.frame[1]
            self.value = self.register(address)
            if address == 0x10E:
                self.value ^= self.flip
        if n in (4, 5) and self.frame[2] == 0x80:
            return self.value >> 8 * (5 - n) & 0xFF
        return 0
