#!/usr/bin/env python3
"""The robot-side programs under docs/robots use the registers, numbers and CRC that the daemon uses: a changed map
cannot leave one of them behind. Their text is compared; no program is run. Usage: robot_programs_test.py SOURCE_DIR"""
import pathlib
import re
import sys
import unittest

SOURCE = pathlib.Path(sys.argv[1])
PROGRAMS = SOURCE / "docs" / "robots"


def numbers_of(path, pattern):
    return {name: int(value, 0) for name, value in re.findall(pattern, (SOURCE / path).read_text())}


def register_map():
    text = (SOURCE / "protocol/register_map.h").read_text()
    result, command = (re.search(r"namespace %s \{(.*?)\}" % space, text, re.S).group(1)
                       for space in ("reg", "command_reg"))
    pairs = r"\b(\w+) = (\d+)\b"
    return ({name: int(value) for name, value in re.findall(pairs, result)},
            {name: int(value) for name, value in re.findall(pairs, command)})


REG, COMMAND = register_map()
WORDS = numbers_of("protocol/register_map.h", r"(block_magic|block_map_version|default_\w+) = (\w+);")
STATUS = numbers_of("protocol/codec.h", r"\b(ready|busy|exposure_done|result_valid|not_ok|error|simulated|"
                                        r"zero_missing|camera_moved) = (\d+)\b")
STATUS["ready"] = int(re.search(r"ready = (\d+), busy", (SOURCE / "protocol/codec.h").read_text()).group(1))
STATE_READY = int(re.search(r"initialized = 1,\s+ready = (\d+)", (SOURCE / "protocol/codec.h").read_text()).group(1))
GOOD = STATUS["ready"] | STATUS["exposure_done"] | STATUS["result_valid"]
MASK = 0xFFFF ^ STATUS["simulated"]
POLYNOMIAL = int(re.search(r"reflected_polynomial = (\w+);", (SOURCE / "protocol/crc32.cpp").read_text()).group(1), 0)


def crc_table():
    """Sixteen entries of the reflected CRC, four bits at a time."""
    table = []
    for value in range(16):
        for _ in range(4):
            value = value >> 1 ^ (POLYNOMIAL if value & 1 else 0)
        table.append(value)
    return table


def signed(value):
    return value - 2**32 if value >= 2**31 else value


def conventions():
    enum = re.search(r"enum class Convention.*?\{(.*?)\}", (SOURCE / "protocol/conventions.h").read_text(), re.S)
    names = [entry.split("=")[0].strip() for entry in enum.group(1).split(",") if entry.strip()]
    return {name: 1 + place for place, name in enumerate(names)}


CONVENTION = conventions()


class Program:
    """How one language writes a register (from: what it counts the first from) and what its checks look like."""

    def __init__(self, files, one, long, origin, checks):
        self.files, self.one, self.long, self.origin, self.checks = files, one, long, origin, checks

    def text(self):
        joined = "\n".join((PROGRAMS / name).read_text(encoding="ascii") for name in self.files)
        return re.sub(r"\s+", "", joined)

    def expected(self, registers):
        def one(name):
            return self.one.format(registers[name] + self.origin)

        def long(name):
            return self.long.format(registers[name] + self.origin, registers[name] + self.origin + 1)

        numbers = {"magic_value": WORDS["block_magic"], "version_value": WORDS["block_map_version"],
                   "result_id": WORDS["default_result_data_id"], "command_id": WORDS["default_command_data_id"],
                   "good": GOOD, "good_simulated": GOOD | STATUS["simulated"], "mask": MASK,
                   "not_ok": STATUS["not_ok"], "busy": STATUS["busy"], "state_ready": STATE_READY,
                   "first_command": COMMAND["first"], **{"is_" + name: n for name, n in CONVENTION.items()}}
        ones = {name: one(name) for name in registers}
        longs = {"long_" + name: long(name) for name in registers}
        places = {"at_" + name: registers[name] + self.origin for name in registers}
        for what, template in self.checks.items():
            yield what, re.sub(r"\s+", "", template.format(**ones, **longs, **places, **numbers))


KUKA = Program(
    ["zeropose.src", "zeropose.dat"], "ZP_R[{0}]", "ZP_I32(ZP_R[{0}],ZP_R[{1}])", 1,
    {"magic": "({magic}=={magic_value})", "map version": "({map_version}=={version_value})",
     "sequence": "({sequence_begin}=={sequence_end})", "CRC": "(B_NOT CRC)=={long_crc}",
     "CRC's extent": "ZP_WORD(-1,ZP_RESULT_ID) FOR I=1 TO 58",
     "epoch": "{long_epoch}<>ZP_EPOCH", "epoch is remembered": "ZP_EPOCH={long_epoch}",
     "own request id": "{long_request_id}<>ZP_ID", "single use": "ZP_ID==ZP_USED", "job": "{job}<>JOB",
     "robot": "{robot_index}<>ZP_ROBOT", "part": "{long_part}<>PART", "convention": "{convention}<>ZP_CONVENTION",
     "its convention": "ZP_CONVENTION={is_kuka};", "frame": "{frame}<>ZP_FRAME",
     "status": "({status} B_AND {mask})<>{good}", "not ok": "({status} B_AND {not_ok})<>0",
     "busy": "({status} B_AND {busy})==0", "code": "{code}<>0", "state": "{state}<>{state_ready}",
     "age": "{age}+ZP_GATEWAY+$TIMER[ZP_TIMER]-ZP_AGE>={validity}", "validity": "{validity}==0",
     "values": "SHIFT.X={long_values}/1000.0", "no value": "(ZP_R[I]==32768)AND(ZP_R[I+1]==0)",
     "first value": "FOR I={at_values} TO", "own limits": ">ZP_MAX_MM",
     "result id": "ZP_RESULT_ID={result_id};", "command id": "ZP_COMMAND_ID={command_id};",
     "Acknowledge": "ZP_SEND(2,0,0,0)", "time-out": "$TIMER[ZP_TIMER]>ZP_PATIENCE"})

FANUC = Program(
    ["zeropose.kl"], "zp_r[{0}]", "zp_i32(zp_r[{0}],zp_r[{1}])", 1,
    {"magic": "({magic}={magic_value})", "map version": "({map_version}={version_value})",
     "sequence": "({sequence_begin}={sequence_end})", "CRC": "(NOT crc)={long_crc}",
     "CRC's extent": "zp_word(-1,result_id) FOR i=1 TO 58", "epoch": "{long_epoch}<>zp_epoch",
     "epoch is remembered": "zp_epoch={long_epoch}", "own request id": "{long_request_id}<>zp_id",
     "single use": "zp_id=zp_used", "job": "{job}<>job", "robot": "{robot_index}<>robot_index",
     "part": "{long_part}<>part", "convention": "{convention}<>convention",
     "its convention": "convention={is_fanuc}--", "frame": "{frame}<>val_frame",
     "status": "({status} AND {mask})<>{good}", "not ok": "({status} AND {not_ok})<>0",
     "busy": "({status} AND {busy})=0", "code": "{code}<>0", "state": "{state}<>{state_ready}",
     "age": "{age}+gateway_ms+zp_clock-zp_asked>={validity}", "validity": "{validity}=0",
     "values": "x={long_values}/1000.0", "no value": "(zp_r[i]=32768)AND(zp_r[i+1]=0)",
     "first value": "FOR i={at_values} TO", "own limits": ">max_mm", "result id": "result_id={result_id}--",
     "command id": "command_id={command_id}--", "Acknowledge": "zp_send(2,0,0,0)", "time-out": "zp_clock>patience"})

ABB = Program(
    ["zeropose.mod"], "zpReg{{{0}}}", "ZpU32({0})", 1,
    {"magic": "{magic}<>{magic_value}", "map version": "{map_version}<>{version_value}",
     "sequence": "{sequence_begin}<>{sequence_end}", "CRC": "4294967295-crc<>{long_crc}",
     "CRC's extent": "FOR i FROM 1 TO 58 DO", "epoch": "{long_epoch}<>zpEpoch",
     "epoch is remembered": "zpEpoch:={long_epoch}", "own request id": "{long_request_id}<>zpId",
     "single use": "zpId=zpUsed", "job": "{job}<>job", "robot": "{robot_index}<>ZP_ROBOT", "part": "{long_part}<>part",
     "convention": "{convention}<>ZP_CONVENTION", "its convention": "ZP_CONVENTION:={is_abb};",
     "frame": "{frame}<>ZP_FRAME", "status": "{status}<>{good} AND {status}<>{good_simulated}",
     "not ok": "BitAnd(ZpLow({at_status}),{not_ok})<>0", "busy": "BitAnd(ZpLow({at_status}),{busy})<>0",
     "code": "{code}<>0", "state": "{state}<>{state_ready}",
     "age": "{age}+1000*(ClkRead(zpClock)-zpAsked)>={validity}", "validity": "{validity}=0",
     "values": "shift.trans:=[DnumToNum(ZpI32({at_values})/1000)", "no value": "zpReg{{i}}=32768 AND zpReg{{i+1}}=0",
     "first value": "FOR i FROM {at_values} TO", "own limits": ">ZP_MAX_MM", "result id": "ZP_RESULT_ID:={result_id};",
     "command id": "ZP_COMMAND_ID:={command_id};", "where commands go": "ZpPut 9,{first_command};",
     "Acknowledge": "ZpSend(2,0,0,0)", "time-out": "ClkRead(zpClock)>ZP_PATIENCE"})

UNIVERSAL = Program(
    ["zeropose.script"], "zp_r[{0}]", "zp_i32({0})", 0,
    {"magic": "{magic}!={magic_value}", "map version": "{map_version}!={version_value}",
     "sequence": "{sequence_begin}!={sequence_end}", "CRC": "zp_crc_high()!={crc} or zp_crc_low()!=zp_r[59]",
     "CRC's extent": "while i<58:", "epoch": "{epoch}!=zp_epoch_high or zp_r[4]!=zp_epoch_low",
     "epoch is remembered": "zp_epoch_high={epoch}", "own request id": "{long_request_id}!=zp_id",
     "single use": "zp_id==zp_used", "job": "{job}!=job", "robot": "{robot_index}!=zp_robot",
     "part": "{long_part}!=part", "convention": "{convention}!=zp_convention",
     "its convention": "zp_convention={is_universal_robots}#",
     "frame": "{frame}!=zp_frame", "status": "{status}!={good} and {status}!={good_simulated}",
     "not ok": "{status}%32>={not_ok}", "busy": "{status}%4>={busy}", "code": "{code}!=0",
     "state": "{state}!={state_ready}", "age": "{age}+zp_since(zp_asked)>={validity}", "validity": "{validity}==0",
     "values": "p[{long_values}/1000000.0", "no value": "zp_r[i]==32768 and zp_r[i+1]==0",
     "first value": "local i={at_values} while",
     "own limits": ">zp_max_m:", "result id": "zp_result_id={result_id}#", "command id": "zp_command_id={command_id}#",
     "where commands go": "zp_put({first_command})", "Acknowledge": "zp_send(2,0,0,0)",
     "time-out": "zp_since(zp_commanded)>zp_patience"})

PLC = Program(
    ["zeropose.st"], "Registers[{0}]", "ZP_Join(High:=Registers[{0}],Low:=Registers[{1}])", 0,
    {"magic": "{magic}=16#{magic_value:04X}", "map version": "{map_version}=16#{version_value:04X}",
     "sequence": "{sequence_begin}={sequence_end}", "CRC": "(Crc XOR 16#FFFFFFFF)={long_crc}",
     "CRC's extent": "FOR I:=0 TO 57 DO", "epoch": "{long_epoch}<>Epoch", "epoch is remembered": "Epoch:={long_epoch}",
     "own request id": "DWORD_TO_UDINT({long_request_id})<>RequestId", "single use": "RequestId=LastUsed",
     "job": "{job}<>Job", "robot": "{robot_index}<>Settings.RobotIndex", "part": "{long_part}<>Part",
     "convention": "{convention}<>Settings.Convention", "its convention": "Convention:WORD:=16#{is_generic:04X};",
     "frame": "{frame}<>Settings.Frame", "status": "({status} AND 16#{mask:04X})<>16#{good:04X}",
     "not ok": "({status} AND 16#{not_ok:04X})<>16#0000", "busy": "({status} AND 16#{busy:04X})<>16#0000",
     "code": "{code}<>16#0000", "state": "{state}<>16#{state_ready:04X}",
     "age": "WORD_TO_DWORD({age})))+SinceRead",
     "validity": "Validity:=DINT_TO_TIME(DWORD_TO_DINT(WORD_TO_DWORD({validity})))",
     "values": "High:=Registers[{at_values}+2*I]", "no value": "(Raw=16#80000000)<>",
     "own limits": ">Settings.Limits[I]",
     "result id": "ResultId:WORD:=16#{result_id:04X};", "command id": "CommandId:WORD:=16#{command_id:04X};",
     "Acknowledge": "Command[2]:=16#0002", "time-out": "SinceCommand.ET>Settings.Patience"})

ALL = {"KUKA": KUKA, "FANUC": FANUC, "ABB": ABB, "Universal Robots": UNIVERSAL, "PLC": PLC}


def words(*pairs):
    return tuple((rf"\b{opens}\b", rf"\b{closes}\b") for opens, closes in pairs)


# What opens a block and what closes it, without comments and texts; and how long a name may be.
FORMS = {
    "zeropose.src": (r";.*", 24, words(("IF", "ENDIF"), ("FOR", "ENDFOR"), ("REPEAT", "UNTIL"), ("DEFFCT", "ENDFCT"),
                                       ("DEF", "END"))),
    "zeropose.kl": (r"--.*|'.*'", 12, words(("IF", "ENDIF"), ("FOR", "ENDFOR"), ("WHILE", "ENDWHILE"),
                                            ("REPEAT", "UNTIL"), ("(?:ROUTINE|PROGRAM)", "END"))),
    "zeropose.mod": (r"!.*|\".*\"", 32, words(("THEN", "ENDIF"), ("FOR", "ENDFOR"), ("WHILE", "ENDWHILE"),
                                              ("FUNC", "ENDFUNC"), ("PROC", "ENDPROC"))),
    "zeropose.script": (r"#.*|\".*?\"", 40, ((r"(?m)^ *(?:def|thread|while|if)\b.*:$", r"(?m)^ *end$"),)),
    "zeropose.st": (r"(?s)\(\*.*?\*\)", 32, words(("IF", "END_IF"), ("FOR", "END_FOR"), ("FUNCTION", "END_FUNCTION"),
                                                  ("FUNCTION_BLOCK", "END_FUNCTION_BLOCK"), ("TYPE", "END_TYPE"),
                                                  ("VAR(?:_INPUT|_OUTPUT)?", "END_VAR"), ("STRUCT", "END_STRUCT"))),
}


class RobotPrograms(unittest.TestCase):
    def test_every_block_is_closed_and_no_name_is_too_long(self):
        for name, (comment, longest, pairs) in FORMS.items():
            text = re.sub(comment, "", (PROGRAMS / name).read_text())
            text = "\n".join(line.rstrip() for line in text.splitlines())
            for opens, closes in pairs:
                with self.subTest(program=name, block=opens):
                    self.assertGreater(len(re.findall(opens, text)), 0)
                    self.assertEqual(len(re.findall(opens, text)), len(re.findall(closes, text)))
            for opens, closes in ("()", "[]", "{}"):
                self.assertEqual(text.count(opens), text.count(closes), f"{name} {opens}{closes}")
            self.assertEqual([word for word in re.findall(r"\b[A-Za-z]\w*", text) if len(word) > longest], [], name)

    def test_every_check_uses_the_daemons_registers_and_numbers(self):
        for name, program in ALL.items():
            text = program.text()
            for what, wanted in program.expected(REG):
                with self.subTest(program=name, check=what):
                    self.assertIn(wanted, text)

    def test_a_moved_register_would_be_noticed_in_every_program(self):
        for field in ("epoch", "request_id", "job", "robot_index", "part", "state", "status", "code", "values",
                      "convention", "frame", "age", "validity", "crc", "sequence_end"):
            moved = dict(REG)
            moved[field] += 1
            for name, program in ALL.items():
                text = program.text()
                missing = [what for what, wanted in program.expected(moved) if wanted not in text]
                with self.subTest(program=name, field=field):
                    self.assertTrue(missing)

    def test_all_programs_have_the_same_checks(self):
        optional = {"where commands go", "first value"}
        wanted = set(KUKA.checks) - optional
        for name, program in ALL.items():
            self.assertEqual(set(program.checks) - optional, wanted, name)

    def test_the_block_is_covered_by_the_crc_up_to_the_crc(self):
        self.assertEqual((REG["crc"], REG["sequence_end"], REG["block_size"]), (58, 60, 61))
        self.assertEqual((COMMAND["crc"], COMMAND["block_size"], COMMAND["first"]), (8, 10, 1000))

    def test_crc_tables_come_from_the_polynomial(self):
        table = crc_table()
        kuka = KUKA.text()
        fanuc = FANUC.text()
        for place, value in enumerate(table):
            self.assertIn(f"ZP_TABLE[{place + 1}]={signed(value)}", kuka)
            self.assertIn(f"zp_table[{place + 1}]={signed(value)}", fanuc)
        self.assertIn("[" + ",".join(map(str, table)) + "];", ABB.text())
        nibbles = [value >> 4 * place & 15 for value in table for place in range(8)]
        self.assertIn("zp_table=[" + ",".join(map(str, nibbles)) + "]", UNIVERSAL.text())
        exclusive = [a ^ b for a in range(16) for b in range(16)]
        self.assertIn("zp_xor=[" + ",".join(map(str, exclusive)) + "]", UNIVERSAL.text())
        self.assertIn(f"SHR(Sum,1)XOR16#{POLYNOMIAL:08X}", PLC.text())

    def test_gateway_signals_follow_each_other(self):
        text = (PROGRAMS / "zeropose.dat").read_text()
        for direction, count in (("IN", REG["block_size"]), ("OUT", COMMAND["block_size"])):
            found = re.findall(rf"SIGNAL ZP_{direction}(\d+) \${direction}\[(\d+)\] TO \${direction}\[(\d+)\]", text)
            self.assertEqual([tuple(map(int, row)) for row in found],
                             [(n, 1001 + 16 * n, 1016 + 16 * n) for n in range(count)])
        program = (PROGRAMS / "zeropose.src").read_text()
        self.assertEqual([tuple(map(int, row)) for row in re.findall(r"ZP_R\[(\d+)\]=ZP_IN(\d+)\n", program)],
                         [(n + 1, n) for n in range(REG["block_size"])])
        self.assertEqual([tuple(map(int, row)) for row in re.findall(r"ZP_OUT(\d+)=ZP_W\[(\d+)\]\n", program)],
                         [(n, n + 1) for n in range(COMMAND["block_size"])])

    def test_they_say_what_they_are(self):
        for path in sorted(PROGRAMS.iterdir()):
            if path.suffix in (".md", ".eds"):
                continue
            text = " ".join(path.read_text(encoding="ascii").split())
            self.assertIn("NOT RUN ON A CONTROLLER", text, path.name)
        for program in ALL.values():
            joined = " ".join("\n".join((PROGRAMS / name).read_text() for name in program.files).split())
            self.assertIn("not a safety function", joined)
        self.assertIn("not a safety function", (PROGRAMS / "README.md").read_text())


if __name__ == "__main__":
    unittest.main(argv=["robot_programs_test.py"])
