#!/bin/sh
# Runs a job script inside a guest with Debian's kernel: run.sh FOLDER LIMIT_S JOB. FOLDER is that of prepare.sh. The job
# sees the host's files read-only, may write to /tmp and /mnt/share, and finds the kernel's modules in $GUEST_MODULES. Its
# output and status are those of this script; 77 with the reason when there can be no guest.
set -eu
folder=$(mkdir -p "$1" && cd "$1" && pwd) limit_s=$2 job=$3
here=$(cd "$(dirname "$0")" && pwd)
"$here/prepare.sh" "$folder" || exit $?

share=$(mktemp -d "${TMPDIR:-/var/tmp}/guest.XXXXXX")
trap 'rm -rf "$share"' EXIT
{ echo "export GUEST_MODULES='$folder/modules'"; cat "$job"; } >"$share/job"

ran=0
# Never -accel kvm: it hangs where /dev/kvm is there but cannot be used.
timeout -k 5 "$limit_s" qemu-system-x86_64 -machine q35 -accel tcg,thread=multi -cpu max -smp 2 -m 768 \
  -nodefaults -no-user-config -display none -no-reboot -serial stdio -monitor none \
  -kernel "$folder/vmlinuz" -initrd "$folder/initrd" \
  -append "console=ttyS0 quiet panic=-1 mitigations=off tsc=reliable no_timer_check random.trust_cpu=on" \
  -virtfs local,path=/,mount_tag=hostroot,security_model=none,readonly=on,multidevs=remap \
  -virtfs "local,path=$share,mount_tag=share,security_model=none" -device virtio-rng-pci \
  </dev/null >"$share/console" 2>&1 || ran=$?
[ -f "$share/output" ] && cat "$share/output"
if [ ! -f "$share/status" ]; then
  echo "the guest did not finish its job within $limit_s s (qemu: status $ran); its console:"
  tail -n 30 "$share/console"
  exit 1
fi
exit "$(cat "$share/status")"
