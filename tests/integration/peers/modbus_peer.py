#!/usr/bin/env python3
"""A robot made of pymodbus alone: unpacks every field and the CRC itself, plays the handshake, tries what is refused.

With --server it starts the test server and knows what to expect; with --host and --port it plays against a running
daemon, where the correction is only shown unless --correction is given.
"""
import random
import sys
import time

from block import (ACKNOWLEDGE, AT_POSITION, BUSY, ERROR, EXPOSED, HALT, HEARTBEAT, INVALID, MEASURE, NOT_OK, READY,
                   RESET, RESUME, SELECT_JOB, SIMULATED, SKIPPED, VALID, ZERO, Block, command, position)
from server import arguments, running

try:
    from pymodbus.client import ModbusTcpClient
except ImportError as missing:
    print(f"skipped: pymodbus is not here ({missing}); apt-get install python3-pymodbus")
    sys.exit(SKIPPED)

COMMANDS, POSITION = 1000, 1100


class Peer:
    def __init__(self, host, port, unit):
        self.client = ModbusTcpClient(host, port=port, timeout=1)
        assert self.client.connect(), f"nobody listens on {host} port {port}"
        self.unit = unit
        self.next_id = random.randrange(1, 1 << 31)
        self.checks = 0

    def block(self, function=4):
        read = self.client.read_input_registers if function == 4 else self.client.read_holding_registers
        answer = read(0, 61, slave=self.unit)
        assert not answer.isError(), answer
        block = Block(answer.registers)
        block.check_form()
        self.checks += 1
        return block

    def write(self, registers, address=COMMANDS):
        """0 when accepted, else the number of the exception."""
        answer = self.client.write_registers(address, registers, slave=self.unit)
        self.checks += 1
        return answer.exception_code if answer.isError() else 0

    def send(self, kind, request_id=None, **fields):
        if request_id is None:
            request_id = self.next_id
            self.next_id += 1
        return request_id, self.write(command(request_id, kind, **fields))

    def wait(self, request_id, patience_s=20):
        """Polls until the answer is there; the states on the way."""
        seen = []
        until = time.monotonic() + patience_s
        while time.monotonic() < until:
            block = self.block()
            if not seen or seen[-1] != block.status:
                seen.append(block.status)
            assert block.request_id == request_id, (block.request_id, request_id)
            if not block.has(BUSY):
                return block, seen
        raise AssertionError("no answer")


def expect_correction(values, options):
    if options.correction is None:
        return
    within = [options.within[0]] * 3 + [options.within[1]] * 3
    assert all(abs(a - b) <= w for a, b, w in zip(values, options.correction, within)), (values, options.correction)


def whole_handshake(peer, options):
    before = peer.block()
    job = options.job
    request_id, refused = peer.send(MEASURE, job=job, part=0x01020304, argument=-5)
    assert refused == 0, refused
    block, seen = peer.wait(request_id)
    if options.server:  # a real measurement may be over between two looks
        assert any(s & BUSY and not s & EXPOSED for s in seen), seen
        assert any(s & BUSY and s & EXPOSED for s in seen), seen
    assert block.has(VALID | READY | EXPOSED) and block.code == 0, (block.status, block.code)
    assert block.epoch == before.epoch and block.part == 0x01020304 and block.job == job
    assert block.age < block.validity
    assert all(v != INVALID for v in block.values[:6]) and block.values[6:] == [INVALID] * 2
    expect_correction(block.values, options)
    mirror = peer.block(function=3)
    assert mirror.values == block.values and mirror.request_id == request_id
    assert peer.send(ACKNOWLEDGE, request_id)[1] == 0
    after = peer.block()
    assert after.request_id == 0 and not after.has(VALID) and after.values == [INVALID] * 8
    return block


def second_while_busy(peer, job, attempts=20):
    """The last request id; on a busy machine the first command may be done before the second comes."""
    for _ in range(attempts):
        last, refused = peer.send(MEASURE, job=job)
        assert refused == 0, refused
        second, refused = peer.send(MEASURE, job=job)
        last = last if refused else second
        peer.wait(last)
        assert peer.send(ACKNOWLEDGE, last)[1] == 0
        if refused:
            assert refused == 6, "a second command while busy"
            return last
    raise AssertionError("never busy")


def refusals(peer, job):
    """None of these may change a register."""
    last = second_while_busy(peer, job)
    before = peer.block()
    wrong_crc = command(peer.next_id, MEASURE, job)
    wrong_crc[8] ^= 0x10
    assert peer.write(wrong_crc) == 3, "wrong CRC"
    assert peer.write(command(peer.next_id, MEASURE, job, data_id=0x5A50)) == 3, "wrong data id"
    assert peer.send(MEASURE, 0, job=job)[1] == 3, "request id 0"
    assert peer.send(MEASURE, last, job=job)[1] == 3, "the same id again"
    assert peer.send(ACKNOWLEDGE, last + 77)[1] == 3, "acknowledge of something else"
    good = command(peer.next_id, MEASURE, job)
    assert peer.write(good[:9]) == 3, "nine registers"
    assert peer.write(good + [0]) == 2, "eleven registers"
    assert peer.write(good, COMMANDS - 1) == 2, "one register too low"
    assert peer.write([0] * 61, 0) == 2, "the result block"
    assert peer.client.write_register(COMMANDS, 1, slave=peer.unit).exception_code == 1, "FC06"
    assert peer.client.write_coil(0, True, slave=peer.unit).exception_code == 1, "FC05"
    assert peer.client.read_coils(0, 8, slave=peer.unit).exception_code == 1, "FC01"
    assert peer.client.read_input_registers(14, 16, slave=peer.unit).exception_code == 2, "only the values"
    assert peer.client.read_input_registers(0, 60, slave=peer.unit).exception_code == 2, "without the last register"
    assert peer.client.read_holding_registers(0, 62, slave=peer.unit).exception_code == 2, "one too many"
    assert not peer.client.read_input_registers(0, 14, slave=peer.unit).isError(), "the head alone"
    after = peer.block()
    assert vars(after) == vars(before), "a refusal has changed the block"


def other_answers(peer, options):
    """Against the test server: every field and every kind of answer."""
    options.job, options.correction = 1, [12345, -6789, 1, 302500, -5678, 1234]  # KUKA: A = rz
    block = whole_handshake(peer, options)
    assert (block.robot, block.convention, block.frame) == (2, 2, 3)
    assert (block.marks, block.cameras, block.deviation, block.sigma) == (11, 4, 250, 31)
    assert (block.config_hash, block.calibration_hash, block.zero_id) == (0x01020304, 0x05060708, 0x09090909)
    assert block.state == 2 and block.validity == 2000 and block.has(SIMULATED)
    # Not ok, and the time-out at the deadline.
    for job, code in ((2, 301), (3, 205)):
        request_id, _ = peer.send(MEASURE, job=job)
        answer, _ = peer.wait(request_id)
        assert answer.has(NOT_OK) and answer.code == code, (answer.status, answer.code)
        assert peer.send(ACKNOWLEDGE, request_id)[1] == 0
    # Withdrawn at the end of its validity.
    request_id, _ = peer.send(MEASURE, job=1)
    assert peer.wait(request_id)[0].has(VALID)
    until = time.monotonic() + 5
    while peer.block().has(VALID):
        assert time.monotonic() < until
    assert peer.block().request_id == 0
    # Withdrawn by a new command.
    request_id, _ = peer.send(MEASURE, job=1)
    assert peer.wait(request_id)[0].has(VALID)
    request_id, _ = peer.send(MEASURE, job=1)
    assert peer.block().has(BUSY)
    peer.wait(request_id)
    zero_and_states(peer)


def zero_and_states(peer):
    def done(kind, **fields):
        request_id, refused = peer.send(kind, **fields)
        assert refused == 0, refused
        answer, _ = peer.wait(request_id)
        return answer

    assert done(ZERO, job=1).code == 104, "the guard"
    zero = done(ZERO, job=1, argument=0x5A45524F)
    assert zero.code == 0 and not zero.status & (VALID | NOT_OK) and zero.zero_id == 0x0A0B0C0D
    assert done(SELECT_JOB, job=1).code == 0
    assert done(HALT).state == 4
    assert done(MEASURE, job=1).code == 105
    assert done(RESUME).state == 2
    assert done(RESET).code == 0
    assert done(AT_POSITION, argument=3).code == 106, "no position was told"
    assert peer.write(position(3, [1000, -2000, 3000, 100000, -200000, 300000]), POSITION) == 0
    told = done(AT_POSITION, argument=3)
    assert told.code == 0 and not told.status & (VALID | NOT_OK)
    assert peer.write(position(3, [1000, -2000, 3000]), POSITION) == 3, "half a pose"
    assert peer.send(HEARTBEAT)[1] == 0
    assert not peer.block().has(ERROR)


def lost_owner(options, port):
    watcher, robot = Peer(options.host, port, options.unit), Peer(options.host, port, options.unit)
    request_id, _ = robot.send(MEASURE, job=1)
    robot.wait(request_id)
    seen = watcher.block()
    assert seen.has(VALID)
    robot.client.close()
    until = time.monotonic() + 5
    while watcher.block().has(VALID):
        assert time.monotonic() < until
    assert watcher.block().epoch != seen.epoch


def main():
    parser = arguments(__doc__)
    parser.add_argument("--job", type=int, default=1)
    parser.add_argument("--correction", type=int, nargs=6, help="the six values on the wire")
    parser.add_argument("--within", type=int, nargs=2, default=[1, 1], help="of the lengths, of the angles")
    options = parser.parse_args()
    with running(options) as port:
        peer = Peer(options.host, port, options.unit)
        block = whole_handshake(peer, options)
        refusals(peer, options.job)
        if options.server:
            other_answers(peer, options)
            lost_owner(options, port)
        whole_handshake(peer, options)
        print(f"pymodbus: {peer.checks} blocks and answers checked, correction {block.values[:6]}")
        peer.client.close()


if __name__ == "__main__":
    main()
