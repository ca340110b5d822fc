"""The two blocks of the robot interface, unpacked by the book and not by the house's own code (docs/modbus.md)."""
import struct

INVALID = -0x80000000
SKIPPED = 77  # CTest: this test could not run here

MEASURE, ACKNOWLEDGE, ZERO, SELECT_JOB, RESET, HEARTBEAT, AT_POSITION, HALT, RESUME = range(1, 10)
READY, BUSY, EXPOSED, VALID, NOT_OK, ERROR, SIMULATED, ZERO_MISSING, CAMERA_MOVED = (1 << i for i in range(9))


def crc32_autosar(data):
    """Bit by bit: polynomial 0xF4ACFB13, reflected in and out, init and final xor 0xFFFFFFFF."""
    def reversed_bits(value, width):
        return int(format(value, f"0{width}b")[::-1], 2)

    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= reversed_bits(byte, 8) << 24
        for _ in range(8):
            crc = ((crc << 1) ^ 0xF4ACFB13 if crc & 0x80000000 else crc << 1) & 0xFFFFFFFF
    return reversed_bits(crc, 32) ^ 0xFFFFFFFF


assert crc32_autosar(b"123456789") == 0x1697D06A


class Block:
    """The 61 registers of the result block. Raises ValueError when a robot must not look at it."""

    FORMAT = ">HHH I I H H I H H H 8i H H H H H H H H I I I 14H I H".replace(" ", "")

    def __init__(self, registers, data_id=0x5A50):
        if len(registers) != 61:
            raise ValueError(f"{len(registers)} registers instead of 61")
        raw = struct.pack(">61H", *registers)
        fields = struct.unpack(self.FORMAT, raw)
        (self.magic, self.version, self.sequence, self.epoch, self.request_id, self.job, self.robot, self.part,
         self.state, self.status, self.code) = fields[:11]
        self.values = list(fields[11:19])
        (self.convention, self.frame, self.age, self.validity, self.marks, self.cameras, self.deviation, self.sigma,
         self.config_hash, self.calibration_hash, self.zero_id) = fields[19:30]
        self.spare = fields[30:44]
        self.crc, self.sequence_end = fields[44:]
        if self.magic != 0x5A50:
            raise ValueError(f"magic {self.magic:#06x}")
        if self.version != 1:
            raise ValueError(f"map version {self.version}")
        if self.sequence != self.sequence_end:
            raise ValueError("torn")
        if self.crc != crc32_autosar(struct.pack(">H", data_id) + raw[:116]):
            raise ValueError("wrong CRC")

    def has(self, bits):
        return self.status & bits == bits

    def check_form(self):
        """What holds for every block, whatever it says."""
        assert any(self.spare) is False, self.spare
        assert self.status & ~0x1FF == 0, self.status
        assert not (self.has(VALID) and self.status & (NOT_OK | BUSY | ERROR)), self.status
        if not self.has(VALID):
            assert self.values == [INVALID] * 8, self.values
        if self.has(NOT_OK):
            assert self.code != 0


def command(request_id, kind, job=0, part=0, argument=0, data_id=0x5A51):
    """The ten registers of the command block."""
    raw = struct.pack(">IHHIi", request_id, kind, job, part, argument)
    return list(struct.unpack(">8H", raw)) + list(
        struct.unpack(">2H", struct.pack(">I", crc32_autosar(struct.pack(">H", data_id) + raw))))


def position(index, values, data_id=0x5A51):
    """The twenty registers of the position block."""
    raw = struct.pack(">I8i", index, *values, *[INVALID] * (8 - len(values)))
    return list(struct.unpack(">18H", raw)) + list(
        struct.unpack(">2H", struct.pack(">I", crc32_autosar(struct.pack(">H", data_id) + raw))))
