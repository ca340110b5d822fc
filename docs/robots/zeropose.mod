MODULE zeropose
  ! Asks for a correction and takes it only when every check passes.
  ! NOT RUN ON A CONTROLLER. Written from the register map of docs/modbus.md and general knowledge of RAPID, not compared with its manual; a
  ! test compares its constants with the daemon's register map. No compiler has seen it.
  ! These checks are process checks, not a safety function.
  !
  ! The module is the Modbus TCP client itself (option PC Interface, for sockets). It keeps the connection open.
  !
  ! A num is exact up to 8388608 only: 32-bit numbers are dnum (exact beyond 2^52); registers and bytes are num.
  !
  ! Use:  reason:=ZpMeasure(1,4711,0,wobjPart.uframe,corrected);
  !       IF reason<>0 THEN
  !         Stop;                      ! no motion
  !       ENDIF
  !       wobjPart.uframe:=corrected;  ! keep the taught one elsewhere: it is wanted again next time
  ! Reason: 0 ok; 1 not asked; 2 no connection or no whole reply; 3 no clean block; 4 command refused; 5 no
  ! answer in time; 6 session epoch; 7 request id; 8 used already; 9 robot index; 10 job; 11 part;
  ! 12 convention; 13 frame; 14 status bits; 15 code; 16 state; 17 age; 18 a value is missing or no rotation;
  ! 19 own limits; 20 still there after Acknowledge; 100 + code: not ok with that code

  LOCAL CONST string ZP_ADDRESS:="192.168.125.10";
  LOCAL CONST num ZP_PORT:=502;
  LOCAL CONST num ZP_UNIT:=1;
  LOCAL CONST num ZP_RESULT_ID:=23120;      ! data id of the result block, 0x5A50
  LOCAL CONST num ZP_COMMAND_ID:=23121;     ! data id of the command block, 0x5A51
  LOCAL CONST num ZP_ROBOT:=1;
  LOCAL CONST num ZP_CONVENTION:=10;        ! ABB
  LOCAL CONST num ZP_FRAME:=3;              ! robot-base shift D_R
  LOCAL CONST num ZP_MAX_MM:=100;           ! own limits: how far the taught frame may move and turn
  LOCAL CONST num ZP_MAX_DEG:=10;
  LOCAL CONST num ZP_PATIENCE:=2;           ! s from the command to its answer
  ! CRC-32/AUTOSAR, polynomial 0xF4ACFB13 reflected (0xC8DF352F), four bits at a time
  LOCAL CONST dnum ZP_TABLE{16}:=[
    0,724315118,1448630236,2104785970,
    2897260472,2275181654,4209571940,3519337354,
    3370071343,3824361153,2659672819,3047901469,
    1685035671,1329836409,842517835,421258917];

  LOCAL PERS dnum zpId:=0;                  ! kept with the program: never the same id twice in a row
  LOCAL PERS dnum zpUsed:=0;                ! the result that was used last
  LOCAL VAR socketdev zpSocket;
  LOCAL VAR byte zpOut{33};
  LOCAL VAR byte zpHead{9};
  LOCAL VAR byte zpBody{122};
  LOCAL VAR byte zpRest{3};
  LOCAL VAR num zpTransaction:=0;
  LOCAL VAR num zpReg{61};                  ! register n is zpReg{n+1}
  LOCAL VAR dnum zpEpoch;
  LOCAL VAR clock zpClock;                  ! since the command
  LOCAL VAR num zpAsked;                    ! zpClock when the last block was asked for, s

  FUNC num ZpMeasure(num job,dnum part,dnum axisUm,pose taught,INOUT pose corrected)
    VAR num reason;
    corrected:=taught;
    reason:=ZpAsk(job,part,axisUm);
    IF reason=0 reason:=ZpTake(taught,corrected);
    IF ZpAcknowledge()<>0 AND reason=0 reason:=20;
    IF reason<>0 corrected:=taught;
    RETURN reason;
  ENDFUNC

  LOCAL FUNC num ZpAsk(num job,dnum part,dnum axisUm)
    VAR num reason;
    ClkStop zpClock;
    ClkReset zpClock;
    ClkStart zpClock;
    reason:=ZpRead();
    IF reason<>0 RETURN reason;
    zpEpoch:=ZpU32(4);
    IF zpEpoch=0 RETURN 6;
    zpId:=zpId+1;
    IF zpId>=4294967295 OR zpId<1 zpId:=1;
    ClkStop zpClock;
    ClkReset zpClock;
    ClkStart zpClock;
    reason:=ZpSend(1,job,part,axisUm);
    IF reason<>0 RETURN reason;
    reason:=ZpRead();
    ! bit 1: busy
    WHILE reason=0 AND ZpU32(6)=zpId AND BitAnd(ZpLow(13),2)<>0 DO
      IF ClkRead(zpClock)>ZP_PATIENCE RETURN 5;
      WaitTime 0.01;
      reason:=ZpRead();
    ENDWHILE
    IF reason<>0 RETURN reason;
    IF ClkRead(zpClock)>ZP_PATIENCE RETURN 5;
    RETURN ZpCheck(job,part);
  ENDFUNC

  LOCAL FUNC num ZpCheck(num job,dnum part)
    IF ZpU32(4)<>zpEpoch RETURN 6;
    IF ZpU32(6)<>zpId RETURN 7;
    IF zpId=zpUsed RETURN 8;
    IF zpReg{9}<>ZP_ROBOT RETURN 9;
    IF zpReg{8}<>job RETURN 10;
    IF ZpU32(10)<>part RETURN 11;
    IF zpReg{31}<>ZP_CONVENTION RETURN 12;
    IF zpReg{32}<>ZP_FRAME RETURN 13;
    IF BitAnd(ZpLow(13),16)<>0 RETURN 100+zpReg{14};
    ! ready, exposure done, result valid, and nothing else but simulated (64)
    IF zpReg{13}<>13 AND zpReg{13}<>77 RETURN 14;
    IF zpReg{14}<>0 RETURN 15;
    IF zpReg{12}<>2 RETURN 16;
    IF ZpTooOld() RETURN 17;
    RETURN 0;
  ENDFUNC

  LOCAL FUNC bool ZpTooOld()
    RETURN zpReg{34}=0 OR zpReg{33}+1000*(ClkRead(zpClock)-zpAsked)>=zpReg{34};
  ENDFUNC

  ! The new frame, when it is within the robot's own limits of the taught one.
  LOCAL FUNC num ZpTake(pose taught,INOUT pose corrected)
    VAR pose shift;
    VAR pose moved;
    VAR num norm;
    VAR num sine;
    FOR i FROM 15 TO 27 STEP 2 DO
      ! 0x80000000: there is no value
      IF zpReg{i}=32768 AND zpReg{i+1}=0 RETURN 18;
    ENDFOR
    ! ABB uses seven values: the last must be empty
    IF zpReg{29}<>32768 OR zpReg{30}<>0 RETURN 18;
    shift.trans:=[DnumToNum(ZpI32(15)/1000),DnumToNum(ZpI32(17)/1000),DnumToNum(ZpI32(19)/1000)];
    shift.rot.q1:=DnumToNum(ZpI32(21)/1000000000);
    shift.rot.q2:=DnumToNum(ZpI32(23)/1000000000);
    shift.rot.q3:=DnumToNum(ZpI32(25)/1000000000);
    shift.rot.q4:=DnumToNum(ZpI32(27)/1000000000);
    zpUsed:=zpId;
    norm:=Sqrt(shift.rot.q1*shift.rot.q1+shift.rot.q2*shift.rot.q2+shift.rot.q3*shift.rot.q3+shift.rot.q4*shift.rot.q4);
    IF Abs(norm-1)>0.0001 RETURN 18;
    shift.rot:=NOrient(shift.rot);
    ! D_R stands in front of the taught frame; how far that moves is seen from the taught frame
    corrected:=PoseMult(shift,taught);
    moved:=PoseMult(PoseInv(taught),corrected);
    IF VectMagn(moved.trans)>ZP_MAX_MM RETURN 19;
    sine:=Sqrt(moved.rot.q2*moved.rot.q2+moved.rot.q3*moved.rot.q3+moved.rot.q4*moved.rot.q4);
    IF sine>Sin(ZP_MAX_DEG/2) RETURN 19;
    ! the time that all this took counts as well
    IF ZpTooOld() RETURN 17;
    RETURN 0;
  ENDFUNC

  ! Withdraws the result, and looks whether it is gone.
  LOCAL FUNC num ZpAcknowledge()
    VAR num reason;
    reason:=ZpSend(2,0,0,0);
    IF reason<>0 RETURN reason;
    reason:=ZpRead();
    IF reason<>0 RETURN reason;
    IF ZpU32(6)=zpId RETURN 20;
    RETURN 0;
  ENDFUNC

  ! FC16 with registers 1000..1009. Measure and Acknowledge carry the same request id.
  LOCAL FUNC num ZpSend(num kind,num job,dnum part,dnum argument)
    VAR dnum crc;
    VAR num reason;
    zpOut{8}:=16;
    ZpPut 9,1000;
    ZpPut 11,10;
    zpOut{13}:=20;
    ZpPutLong 14,zpId;
    ZpPut 18,kind;
    ZpPut 20,job;
    ZpPutLong 22,part;
    IF argument<0 argument:=argument+4294967296;
    ZpPutLong 26,argument;
    crc:=ZpWord(4294967295,ZP_COMMAND_ID DIV 256,ZP_COMMAND_ID MOD 256);
    FOR i FROM 14 TO 28 STEP 2 DO
      crc:=ZpWord(crc,zpOut{i},zpOut{i+1});
    ENDFOR
    ZpPutLong 30,4294967295-crc;
    reason:=ZpExchange(33,16);
    RETURN reason;
  ENDFUNC

  ! FC04 of registers 0..60. 0: a whole block in zpReg: magic, map version, sequence numbers and CRC are right.
  LOCAL FUNC num ZpRead()
    VAR dnum crc;
    VAR num reason;
    zpAsked:=ClkRead(zpClock);
    zpOut{8}:=4;
    ZpPut 9,0;
    ZpPut 11,61;
    reason:=ZpExchange(12,4);
    IF reason<>0 RETURN reason;
    FOR i FROM 1 TO 61 DO
      zpReg{i}:=256*zpBody{2*i-1}+zpBody{2*i};
    ENDFOR
    IF zpReg{1}<>23120 OR zpReg{2}<>1 OR zpReg{3}<>zpReg{61} RETURN 3;
    crc:=ZpWord(4294967295,ZP_RESULT_ID DIV 256,ZP_RESULT_ID MOD 256);
    FOR i FROM 1 TO 58 DO
      crc:=ZpWord(crc,zpBody{2*i-1},zpBody{2*i});
    ENDFOR
    IF 4294967295-crc<>ZpU32(59) RETURN 3;
    RETURN 0;
  ENDFUNC

  ! One request, one reply. Whatever goes wrong closes the socket, so that no late reply meets the next request.
  LOCAL FUNC num ZpExchange(num size,num function)
    zpTransaction:=(zpTransaction+1) MOD 65536;
    ZpPut 1,zpTransaction;
    ZpPut 3,0;
    ZpPut 5,size-6;
    zpOut{7}:=ZP_UNIT;
    IF SocketGetStatus(zpSocket)<>SOCKET_CONNECTED THEN
      SocketClose zpSocket;
      SocketCreate zpSocket;
      SocketConnect zpSocket,ZP_ADDRESS,ZP_PORT\Time:=1;
    ENDIF
    SocketSend zpSocket\Data:=zpOut\NoOfBytes:=size;
    SocketReceive zpSocket\Data:=zpHead\ReadNoOfBytes:=9\Time:=1;
    IF zpHead{1}<>zpOut{1} OR zpHead{2}<>zpOut{2} OR zpHead{3}<>0 OR zpHead{4}<>0 OR zpHead{5}<>0 OR zpHead{7}<>ZP_UNIT THEN
      SocketClose zpSocket;
      RETURN 2;
    ENDIF
    IF zpHead{8}=function+128 AND zpHead{6}=3 RETURN 4;
    IF zpHead{8}=4 AND function=4 AND zpHead{6}=125 AND zpHead{9}=122 THEN
      SocketReceive zpSocket\Data:=zpBody\ReadNoOfBytes:=122\Time:=1;
      RETURN 0;
    ENDIF
    IF zpHead{8}=16 AND function=16 AND zpHead{6}=6 THEN
      SocketReceive zpSocket\Data:=zpRest\ReadNoOfBytes:=3\Time:=1;
      RETURN 0;
    ENDIF
    SocketClose zpSocket;
    RETURN 2;
  ERROR
    SocketClose zpSocket;
    RETURN 2;
  ENDFUNC

  ! The CRC goes on over one register, high byte first; of each byte the low four bits first.
  LOCAL FUNC dnum ZpWord(dnum crc,num high,num low)
    crc:=ZpNibble(crc,high MOD 16);
    crc:=ZpNibble(crc,high DIV 16);
    crc:=ZpNibble(crc,low MOD 16);
    crc:=ZpNibble(crc,low DIV 16);
    RETURN crc;
  ENDFUNC

  LOCAL FUNC dnum ZpNibble(dnum crc,num n)
    VAR num index;
    index:=DnumToNum(BitAndDnum(BitXOrDnum(crc,NumToDnum(n)),15))+1;
    RETURN BitXOrDnum(BitRShDnum(crc,4),ZP_TABLE{index});
  ENDFUNC

  ! Two registers, high word first; i is the first one's place in zpReg.
  LOCAL FUNC dnum ZpU32(num i)
    RETURN 65536*NumToDnum(zpReg{i})+NumToDnum(zpReg{i+1});
  ENDFUNC

  LOCAL FUNC dnum ZpI32(num i)
    VAR dnum value;
    value:=ZpU32(i);
    IF value>=2147483648 RETURN value-4294967296;
    RETURN value;
  ENDFUNC

  ! The low byte of a register, for BitAnd, which takes bytes.
  LOCAL FUNC byte ZpLow(num i)
    VAR byte low;
    low:=zpReg{i} MOD 256;
    RETURN low;
  ENDFUNC

  LOCAL PROC ZpPut(num place,num value)
    zpOut{place}:=value DIV 256;
    zpOut{place+1}:=value MOD 256;
  ENDPROC

  LOCAL PROC ZpPutLong(num place,dnum value)
    ZpPut place,DnumToNum(value DIV 65536);
    ZpPut place+2,DnumToNum(value MOD 65536);
  ENDPROC
ENDMODULE
