/* A disk that is full at one call: the ENOSPC_AT-th that writes, makes or renames a file below the
   folder ENOSPC_UNDER, and all after it. With ENOSPC_COUNT the calls are counted, and their number
   written to that file at the end. To be put before the system's library with LD_PRELOAD. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

static long calls;

/* Whether this call, of a file of that name, is to fail. */
static int fails_at(const char *path) {
    const char *under = getenv("ENOSPC_UNDER"), *at = getenv("ENOSPC_AT");
    char whole[4096];
    if (under == NULL || path == NULL) return 0;
    if (path[0] != '/') {
        if (getcwd(whole, 2000) == NULL || strlen(path) > 2000) return 0;
        strcat(strcat(whole, "/"), path);
        path = whole;
    }
    if (strncmp(path, under, strlen(under)) != 0) return 0;
    long call = __atomic_add_fetch(&calls, 1, __ATOMIC_SEQ_CST);
    if (at == NULL || call < atol(at)) return 0;
    errno = ENOSPC;
    return 1;
}

static int fails(int file) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return fails_at(path);
}

__attribute__((destructor)) static void count(void) {
    const char *name = getenv("ENOSPC_COUNT");
    if (name == NULL) return;
    FILE *file = fopen(name, "w");
    if (file == NULL) return;
    fprintf(file, "%ld\n", calls);
    fclose(file);
}

#define REAL(type, name, ...) ((type(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name))

ssize_t write(int file, const void *bytes, size_t count) {
    return fails(file) ? -1 : REAL(ssize_t, "write", int, const void *, size_t)(file, bytes, count);
}

ssize_t writev(int file, const struct iovec *parts, int count) {
    return fails(file) ? -1
                       : REAL(ssize_t, "writev", int, const struct iovec *, int)(file, parts, count);
}

ssize_t pwrite64(int file, const void *bytes, size_t count, off64_t at) {
    return fails(file) ? -1
                       : REAL(ssize_t, "pwrite64", int, const void *, size_t, off64_t)(file, bytes, count, at);
}

int mkdir(const char *path, mode_t mode) {
    return fails_at(path) ? -1 : REAL(int, "mkdir", const char *, mode_t)(path, mode);
}

int rename(const char *from, const char *to) {
    return fails_at(to) ? -1 : REAL(int, "rename", const char *, const char *)(from, to);
}

int open64(const char *path, int flags, ...) {
    va_list more;
    va_start(more, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(more, mode_t) : 0;
    va_end(more);
    if ((flags & O_CREAT) && fails_at(path)) return -1;
    return REAL(int, "open64", const char *, int, ...)(path, flags, mode);
}
