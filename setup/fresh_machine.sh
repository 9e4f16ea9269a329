#!/usr/bin/env bash
# Prove that the cell works on a bare Debian 12, made by debootstrap in a folder: as root, and as a user with sudo.
#   sudo setup/fresh_machine.sh FOLDER [COMMAND ...]      # default: ./cell demo, then ./cell up until its page answers
# The committed state is what is tried. Needs root, debootstrap and a network; FOLDER is made anew and stays.
# DEBIAN_MIRROR names another mirror; this machine's apt sources, pip configuration and proxies are taken over.
set -euo pipefail
root=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/.." && pwd)

refuse() {
  echo "fresh_machine: $*" >&2
  exit 1
}

[ $# -ge 1 ] || refuse "name a folder for the machine, for example: sudo setup/fresh_machine.sh /tmp/fresh"
folder=$(readlink -m "$1")
shift
command=("$@")
[ ${#command[@]} -gt 0 ] || command=(./cell demo "&&" bash setup/up_once.sh)
[ "$(id -u)" = 0 ] || refuse "needs root: sudo setup/fresh_machine.sh $folder"
command -v debootstrap >/dev/null || refuse "needs debootstrap: apt-get install debootstrap"
[ ! -e "$folder" ] || [ -f "$folder/.fresh_machine" ] ||
  refuse "$folder is there and was not made by this script: name another folder"

# End every process that still runs inside the machine, and let go of what was mounted.
leave() {
  local pid
  for pid in /proc/[0-9]*; do
    [ "$(readlink "$pid/root" 2>/dev/null)" != "$folder" ] || kill -9 "${pid#/proc/}" 2>/dev/null || true
  done
  for mounted in dev/shm dev/pts dev proc sys; do
    ! mountpoint --quiet "$folder/$mounted" || umount --lazy "$folder/$mounted"
  done
}
trap leave EXIT

make_machine() {
  leave
  rm -rf --one-file-system "$folder"
  mkdir -p "$folder"
  touch "$folder/.fresh_machine"
  # The bare system is the same each time: it is kept beside the folder, and unpacked again.
  if [ -f "$folder.tar" ]; then
    tar --extract --file "$folder.tar" --directory "$folder" --numeric-owner
  else
    debootstrap --variant=minbase --include=bash,ca-certificates,git,python3,sudo,passwd \
      bookworm "$folder" "${DEBIAN_MIRROR:-$(mirror_of_this_machine)}"
    tar --create --file "$folder.tar.part" --directory "$folder" --numeric-owner .
    mv "$folder.tar.part" "$folder.tar"
  fi
  # Where this machine's packages come from, those of the new one come from too.
  cp -a /etc/apt/. "$folder/etc/apt/"
  cp -L /etc/resolv.conf "$folder/etc/resolv.conf" 2>/dev/null || true
  cp -L /etc/hosts "$folder/etc/hosts" 2>/dev/null || true
  [ ! -f /etc/pip.conf ] || cp /etc/pip.conf "$folder/etc/pip.conf"
  mkdir -p "$folder/usr/local/share/ca-certificates"
  cp -a /usr/local/share/ca-certificates/. "$folder/usr/local/share/ca-certificates/" 2>/dev/null || true
  # Kernel folders are made read-only where it does not matter: nothing of this machine is changed.
  mount -t proc proc "$folder/proc"
  mount --rbind --make-rslave /sys "$folder/sys"
  mount --rbind --make-rslave /dev "$folder/dev"
  chroot "$folder" update-ca-certificates >/dev/null 2>&1 || true
  chroot "$folder" id person >/dev/null 2>&1 || chroot "$folder" useradd --create-home --shell /bin/bash person
  echo 'person ALL=(ALL) NOPASSWD: ALL' >"$folder/etc/sudoers.d/person"
}

# Print the address that this machine's apt takes Debian from.
mirror_of_this_machine() {
  local found
  found=$(apt-get indextargets --format '$(SITE)' 'Codename: bookworm' 'Created-By: Packages' 2>/dev/null | head -n 1)
  [ -n "$found" ] || refuse "this machine's apt sources name no mirror: set DEBIAN_MIRROR"
  echo "$found"
}

# Print how much the machine holds [MB].
size_of_machine() { du --summarize --one-file-system --block-size=MB "$folder" | cut -d M -f 1; }

# Run the command in a copy of the committed state: person, their home.
try_as() {
  local person=$1 home=$2 bare begun
  bare=$(size_of_machine)
  begun=$SECONDS
  local kept=(LANG=C.UTF-8)
  for name in http_proxy https_proxy no_proxy HTTP_PROXY HTTPS_PROXY NO_PROXY PIP_INDEX_URL PIP_CONFIG_FILE; do
    [ -z "${!name:-}" ] || kept+=("$name=${!name}")
  done
  rm -rf "$folder$home/cell"
  mkdir -p "$folder$home/cell"
  git -C "$root" archive HEAD | tar -x -C "$folder$home/cell"
  chroot "$folder" chown -R "$person:" "$home/cell"
  echo "fresh_machine: as $person: ${command[*]}"
  local code=0
  chroot "$folder" su --login "$person" --command \
    "cd $home/cell && env $(printf '%q ' "${kept[@]}") ${command[*]}" || code=$?
  echo "fresh_machine: as $person: exit code $code after $((SECONDS - begun)) s, $(($(size_of_machine) - bare)) MB more on the disk"
  return $code
}

make_machine
try_as root /root || refuse "failed as root; the machine is in $folder"
make_machine
try_as person /home/person || refuse "failed as a user with sudo; the machine is in $folder"
echo "fresh_machine: both passed"
