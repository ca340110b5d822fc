#!/usr/bin/env python3
"""A robot controller that is a Modbus server, made of pymodbus: the daemon writes the result into its registers.

The block and its CRC are unpacked here by the book. The controller is then killed in mid-cycle, late, stubborn and
wrong, and after each of these a clean cycle must follow.
"""
import argparse
import asyncio
import logging
import sys
import threading
import time

from block import ACKNOWLEDGE, BUSY, INVALID, MEASURE, NOT_OK, SKIPPED, VALID, Block, command
from wire import running, until

try:
    from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
    from pymodbus.server.async_io import ModbusTcpServer
except ImportError as missing:
    print(f"skipped: pymodbus is not here ({missing}); apt-get install python3-pymodbus")
    sys.exit(SKIPPED)

COMMAND, RESULT, LIFE = 128, 140, 201
CORRECTION = [12345, -6789, 1, 302500, -5678, 1234, INVALID, INVALID]  # KUKA: A = rz


class Registers(ModbusSequentialDataBlock):
    """What the controller's program and the daemon share. Each write is looked at, as a robot might at any time."""

    def __init__(self):
        super().__init__(0, [0] * 65536)
        self.fault = None
        self.late_s = 0
        self.fault_acted = 0
        self.spoilt = False  # by a fault of this controller, until a whole block is written again
        self.torn = self.whole = self.unmarked = 0

    def getValues(self, address, count=1):
        time.sleep(self.late_s)
        self.fault_acted += self.late_s > 0
        return super().getValues(address, count)

    def setValues(self, address, values):
        if self.fault == "refuse":
            self.fault_acted += 1
            raise ValueError("refused on purpose")  # pymodbus answers with exception 04
        values = list(values)
        if self.fault == "other" and address <= RESULT + 15 < address + len(values):
            values[RESULT + 15 - address] ^= 1
            self.fault_acted += 1
            self.spoilt = True
        super().setValues(address, values)
        if RESULT <= address < RESULT + 61:
            self.look()

    def look(self):
        shown = self.values[RESULT:RESULT + 61]
        try:
            Block(shown).check_form()
            self.whole += 1
            self.spoilt = False
        except ValueError:
            self.torn += 1
            self.unmarked += shown[2] == shown[60] and not self.spoilt


class Controller:
    def __init__(self):
        self.registers = Registers()
        self.port = 0
        self.next_id = 100
        self.start()

    def start(self):
        started = threading.Event()
        self.thread = threading.Thread(target=lambda: asyncio.run(self.serve(started)))
        self.thread.start()
        assert started.wait(5)

    async def serve(self, started):
        context = ModbusServerContext(ModbusSlaveContext(hr=self.registers, zero_mode=True), single=True)
        self.loop, self.stopping = asyncio.get_running_loop(), asyncio.Event()
        server = ModbusTcpServer(context, address=("127.0.0.1", self.port), allow_reuse_address=True)
        task = asyncio.create_task(server.serve_forever())
        await server.serving
        self.port = server.server.sockets[0].getsockname()[1]
        started.set()
        await self.stopping.wait()
        for connection in server.active_connections.values():
            connection.transport.abort()
        server.server.close()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    def kill(self):
        self.loop.call_soon_threadsafe(self.stopping.set)
        self.thread.join()

    # What the program on the controller does.
    def write(self, registers):
        self.registers.values[COMMAND:COMMAND + 10] = registers

    def send(self, kind, request_id=None, **fields):
        if request_id is None:
            self.next_id += 1
            request_id = self.next_id
        self.write(command(request_id, kind, **fields))
        return request_id

    def block(self):
        """The last whole one."""
        for _ in range(2000):
            try:
                return Block(self.registers.values[RESULT:RESULT + 61])
            except ValueError:
                time.sleep(0.001)
        raise AssertionError("no whole block")

    def life(self):
        counter, high, low, exception = self.registers.values[LIFE:LIFE + 4]
        return counter, high << 16 | low, exception


def measured(controller, job=1):
    """Sends Measure and waits for its answer."""
    request_id = controller.send(MEASURE, job=job, part=77)
    until(lambda: controller.block().request_id == request_id, "the daemon takes the command")
    until(lambda: not controller.block().has(BUSY), "an answer")
    block = controller.block()
    assert block.request_id == request_id, (block.request_id, request_id)
    return block


def clean_cycle(controller):
    block = measured(controller)
    assert block.has(VALID) and block.code == 0 and block.values == CORRECTION, vars(block)
    assert (block.robot, block.convention, block.part, block.marks) == (2, 2, 77, 11)
    until(lambda: controller.life()[1:] == (block.request_id, 0), "it is told that the command was accepted")
    controller.send(ACKNOWLEDGE, block.request_id)
    until(lambda: not controller.block().has(VALID), "the result is withdrawn")
    assert controller.block().values == [INVALID] * 8
    return block


def new_epoch(controller, before):
    until(lambda: controller.block().epoch != before.epoch, "a new session")
    assert not controller.block().has(VALID) and controller.block().request_id == 0


def refusals(controller):
    assert measured(controller, job=2).code == 301
    late = measured(controller, job=3)
    assert late.has(NOT_OK) and late.code == 205
    request_id = controller.send(MEASURE, job=1)
    until(lambda: controller.block().has(BUSY), "busy")
    second = controller.send(MEASURE, job=1)
    until(lambda: controller.life()[1:] == (second, 6), "busy is told")
    until(lambda: controller.block().has(VALID), "the first is not disturbed")
    assert controller.block().request_id == request_id
    wrong = command(controller.next_id + 1, MEASURE, job=1)
    wrong[8] ^= 0x10
    controller.write(wrong)
    until(lambda: controller.life()[1:] == (controller.next_id + 1, 3), "the wrong CRC is told")
    controller.next_id += 1
    # As a robot program writes: one register after the other, the CRC last.
    for at, value in enumerate(command(controller.next_id + 1, MEASURE, job=1)):
        controller.registers.values[COMMAND + at] = value
        time.sleep(0.005)
    controller.next_id += 1
    until(lambda: controller.block().request_id == controller.next_id, "a command in pieces is taken when it is whole")
    until(lambda: controller.block().has(VALID), "and answered")


def killed_in_mid_cycle(controller):
    before = clean_cycle(controller)
    controller.send(MEASURE, job=1)
    until(lambda: controller.block().has(BUSY), "busy")
    controller.kill()
    controller.start()  # with the old command and the old block in its registers
    new_epoch(controller, before)
    stale = controller.next_id
    beats = controller.life()[0]
    until(lambda: controller.life()[0] - beats & 0xFFFF >= 4, "signs of life")
    assert controller.block().request_id == 0 and controller.life()[1:] == (stale, 3)
    clean_cycle(controller)


def with_a_valid_result(controller, fault):
    """The fault comes while a result is valid; it must be gone in the next session."""
    before = measured(controller)
    assert before.has(VALID)
    acted = controller.registers.fault_acted
    fault(controller.registers)
    # Three tries are one connection: the fourth shows that it was given up.
    until(lambda: controller.registers.fault_acted >= acted + 4, "the fault is met")
    controller.registers.fault, controller.registers.late_s = None, 0
    new_epoch(controller, before)
    clean_cycle(controller)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wire", required=True, help="the program modbus_test_wire")
    options = parser.parse_args()
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    for more in ([], [16]):
        controller = Controller()
        try:
            with running(options.wire, "client", controller.port, *more):
                controller.block()  # a command from before the daemon came would not count
                for _ in range(3):
                    clean_cycle(controller)
                refusals(controller)
                clean_cycle(controller)
                killed_in_mid_cycle(controller)
                with_a_valid_result(controller, lambda registers: setattr(registers, "late_s", 0.4))
                with_a_valid_result(controller, lambda registers: setattr(registers, "fault", "refuse"))
                with_a_valid_result(controller, lambda registers: setattr(registers, "fault", "other"))
                last = measured(controller)
                assert last.has(VALID)
            assert not controller.block().has(VALID), "the daemon has ended and left a valid result"
            seen = controller.registers
            assert seen.whole > 50, seen.whole
            assert seen.torn > 50 or not more, seen.torn
            assert seen.unmarked == 0, f"{seen.unmarked} half written blocks with equal sequence numbers"
            print(f"pymodbus as controller {more}: {seen.whole} whole blocks, {seen.torn} unusable ones seen as such")
        finally:
            controller.kill()


if __name__ == "__main__":
    main()
