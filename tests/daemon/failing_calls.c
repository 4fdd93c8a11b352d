// Makes the FAIL_AT-th call of the kind FAIL_KIND in lensd fail, counted from its start, and tells at the end how many
// of each kind there were (FAIL_REPORT). Calls of the libraries that lensd uses are left alone, but for those of the
// C++ library, by which it reads and writes files.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

enum { OPEN, READ, WRITE, FSYNC, RENAME, ACCEPT, SEND, MMAP, KINDS };
static const char* const kNames[KINDS] = {"open", "read", "write", "fsync", "rename", "accept", "send", "mmap"};
static const int kErrors[KINDS] = {EMFILE, EIO, ENOSPC, EIO, EIO, EMFILE, ENOBUFS, ENOMEM};
static atomic_long counts[KINDS];
static int failing = -1;
static long fail_at;

__attribute__((constructor)) static void Begin(void) {
  const char* kind = getenv("FAIL_KIND");
  const char* at = getenv("FAIL_AT");
  for (int i = 0; kind && at && i < KINDS; ++i) {
    if (strcmp(kind, kNames[i]) == 0) failing = i;
  }
  fail_at = at ? atol(at) : 0;
}

__attribute__((destructor)) static void End(void) {
  const char* path = getenv("FAIL_REPORT");
  FILE* file = path ? fopen(path, "w") : NULL;
  if (!file) return;
  for (int i = 0; i < KINDS; ++i) fprintf(file, "%s %ld\n", kNames[i], atomic_load(&counts[i]));
  fclose(file);
}

static int Fails(int kind, const void* caller) {
  Dl_info from;
  if (!dladdr(caller, &from) || !from.dli_fname) return 0;
  const char* name = strrchr(from.dli_fname, '/');
  name = name ? name + 1 : from.dli_fname;
  if (strncmp(name, "lensd", 5) != 0 && strncmp(name, "libstdc++", 9) != 0) return 0;
  if (atomic_fetch_add(&counts[kind], 1) + 1 != fail_at || kind != failing) return 0;
  errno = kErrors[kind];
  return 1;
}

#define HERE __builtin_return_address(0)
#define NEXT(type, name) ((type)dlsym(RTLD_NEXT, name))
#define CALL(kind, result, name, parameters, arguments) \
  result name parameters {                              \
    if (Fails(kind, HERE)) return (result) - 1;         \
    return NEXT(result(*) parameters, #name) arguments; \
  }
#define OPENS(name, parameters, arguments)                                            \
  int name parameters {                                                               \
    va_list list;                                                                     \
    va_start(list, flags);                                                            \
    const mode_t mode = (flags & (O_CREAT | __O_TMPFILE)) ? va_arg(list, mode_t) : 0; \
    va_end(list);                                                                     \
    if (Fails(OPEN, HERE)) return -1;                                                 \
    return NEXT(int(*) parameters, #name) arguments;                                  \
  }

OPENS(open, (const char* path, int flags, ...), (path, flags, mode))
OPENS(open64, (const char* path, int flags, ...), (path, flags, mode))
OPENS(openat, (int folder, const char* path, int flags, ...), (folder, path, flags, mode))
FILE* fopen64(const char* path, const char* mode) {
  if (Fails(OPEN, HERE)) return NULL;
  return NEXT(FILE * (*)(const char*, const char*), "fopen64")(path, mode);
}
CALL(OPEN, int, mkstemp, (char* name), (name))
CALL(OPEN, int, mkostemp, (char* name, int flags), (name, flags))
CALL(READ, ssize_t, read, (int fd, void* to, size_t size), (fd, to, size))
CALL(READ, ssize_t, recv, (int fd, void* to, size_t size, int flags), (fd, to, size, flags))
CALL(READ, ssize_t, recvmsg, (int fd, struct msghdr* to, int flags), (fd, to, flags))
CALL(WRITE, ssize_t, write, (int fd, const void* from, size_t size), (fd, from, size))
CALL(WRITE, ssize_t, writev, (int fd, const struct iovec* from, int count), (fd, from, count))
CALL(FSYNC, int, fsync, (int fd), (fd))
CALL(FSYNC, int, fdatasync, (int fd), (fd))
CALL(RENAME, int, rename, (const char* from, const char* to), (from, to))
CALL(ACCEPT, int, accept, (int fd, struct sockaddr* from, socklen_t* size), (fd, from, size))
CALL(ACCEPT, int, accept4, (int fd, struct sockaddr* from, socklen_t* size, int flags), (fd, from, size, flags))
CALL(SEND, ssize_t, send, (int fd, const void* from, size_t size, int flags), (fd, from, size, flags))
CALL(SEND, ssize_t, sendmsg, (int fd, const struct msghdr* from, int flags), (fd, from, flags))
void* mmap(void* at, size_t size, int protection, int flags, int fd, off_t offset) {
  if (Fails(MMAP, HERE)) return MAP_FAILED;
  return NEXT(void* (*)(void*, size_t, int, int, int, off_t), "mmap")(at, size, protection, flags, fd, offset);
}
void* mmap64(void* at, size_t size, int protection, int flags, int fd, off_t offset) {
  if (Fails(MMAP, HERE)) return MAP_FAILED;
  return NEXT(void* (*)(void*, size_t, int, int, int, off_t), "mmap64")(at, size, protection, flags, fd, offset);
}
