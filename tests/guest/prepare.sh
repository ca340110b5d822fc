#!/bin/sh
# Makes what the guest boots from: prepare.sh FOLDER. The kernel is Debian's own, taken apart and not installed; FOLDER
# keeps it. Exit 77 and the reason when something for it cannot be had.
set -eu
folder=$1
skip() { echo "skipped: $*"; exit 77; }

for tool in qemu-system-x86_64 busybox cpio depmod xz dpkg-deb apt-get apt-cache; do
  PATH=$PATH:/usr/sbin:/sbin command -v "$tool" >/dev/null || skip "$tool is missing; see .ci/install-packages"
done
[ "$folder/initrd" -nt "$(dirname "$0")/init" ] && [ -f "$folder/vmlinuz" ] && exit 0

mkdir -p "$folder"
making=$folder/making.$$
trap 'rm -rf "$making"' EXIT
mkdir -p "$making/download" "$making/kernel" "$making/initrd/bin" "$making/initrd/lib"

# The name drifts with every update of the kernel.
package=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/^ *Depends: \(linux-image-[0-9].*\)/\1/p' | head -1)
[ -n "$package" ] || skip "apt-cache knows no linux-image-amd64"
(cd "$making/download" && timeout 120 apt-get download "$package" >download.log 2>&1) ||
  skip "kernel package $package cannot be downloaded: $(grep -m1 '^E:' "$making/download/download.log" || echo 'no answer')"

modules=./lib/modules/${package#linux-image-}
drivers=$modules/kernel/drivers
# The patterns are tar's.
dpkg-deb --fsys-tarfile "$making"/download/*.deb | tar -x -C "$making/kernel" --wildcards \
  './boot/vmlinuz*' "$modules/modules.*" "$modules/kernel/net/can/*" "$modules/kernel/drivers/net/can/*" \
  "$drivers/media/v4l2-core/*" "$drivers/media/mc/*" "$drivers/media/common/*" "$drivers/media/cec/core/*" \
  "$drivers/media/rc/rc-core.ko" "$drivers/media/test-drivers/vivid/*" "$modules/kernel/net/9p/*" \
  "$modules/kernel/fs/9p/*" "$modules/kernel/fs/netfs/*" "$modules/kernel/fs/fscache/*" \
  "$modules/kernel/fs/overlayfs/*" "$modules/kernel/fs/autofs/*" "$drivers/virtio/*" \
  "$drivers/char/hw_random/virtio-rng.ko" "$drivers/char/hw_random/rng-core.ko" "$drivers/video/fbdev/*" \
  2>/dev/null || true  # what a kernel has built in is no file
[ -d "$making/kernel/$modules/kernel/drivers/media/test-drivers/vivid" ] || skip "$package has no vivid"
version=${package#linux-image-}
/sbin/depmod -b "$making/kernel" "$version" 2>/dev/null || depmod -b "$making/kernel" "$version"

# The modules for the host's files over 9p, in the order in which they need each other.
list=$making/initrd/modules.list
for wanted in virtio_pci virtio-rng 9pnet_virtio 9p; do
  /sbin/modprobe -d "$making/kernel" -S "$version" --show-depends "$wanted" 2>/dev/null || true
done | sed -n 's/^insmod \([^ ]*\).*/\1/p' | awk '!seen[$0]++' >"$list.paths"
while read -r path; do
  cp "$path" "$making/initrd/lib/"
  basename "$path"
done <"$list.paths" >"$list"
rm "$list.paths"
cp "$(command -v busybox)" "$making/initrd/bin/busybox"
cp "$(dirname "$0")/init" "$making/initrd/init"
chmod 755 "$making/initrd/init"
(cd "$making/initrd" && find . | cpio -o -H newc --quiet) >"$making/initrd.cpio"
gzip -1 <"$making/initrd.cpio" >"$making/initrd.gz"

rm -rf "$folder/modules"
mv "$making/kernel" "$folder/modules"
cp "$folder"/modules/boot/vmlinuz* "$folder/vmlinuz"
echo "$version" >"$folder/version"
mv "$making/initrd.gz" "$folder/initrd"  # last: it says that all is there
echo "prepared kernel $version in $folder"
