/PROG  ZPMEAS
/ATTR
OWNER           = MNEDITOR;
COMMENT         = "ZEROPOSE";
PROTECT         = READ_WRITE;
TCD:  STACK_SIZE        = 0,
      TASK_PRIORITY     = 50,
      TIME_SLICE        = 0,
      BUSY_LAMP_OFF     = 0,
      ABORT_REQUEST     = 0,
      PAUSE_REQUEST     = 0;
DEFAULT_GROUP   = 1,*,*,*,*;
/MN
   1:  !NOT RUN ON A CONTROLLER ;
   2:  !Process check, no safety function ;
   3:  !PR[11] taught frame X_RO0 ;
   4:  !PR[10] new frame, R[50] reason ;
   5:  !R[51] job, R[52] part ;
   6:  R[50]=1 ;
   7:  CALL ZEROPOSE(R[51],R[52],0,11,10,50) ;
   8:  IF R[50]<>0,JMP LBL[99] ;
   9:  UFRAME[2]=PR[10] ;
  10:  UFRAME_NUM=2 ;
  11:  END ;
  12:  LBL[99] ;
  13:  !no motion: UFRAME stays as taught ;
  14:  UFRAME[2]=PR[11] ;
  15:  UALM[1] ;
  16:  ABORT ;
/POS
/END
