/* A wall clock that jumps by up to LARGEST seconds, for LD_PRELOAD. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/time.h>
#include <time.h>

/* The right time and half of a second are in the same jump; the next is anywhere. */
static time_t jump(const struct timespec *now) {
    unsigned seed = 2 * now->tv_sec + (now->tv_nsec >= 500000000);
    return rand_r(&seed) % (2 * LARGEST + 1) - LARGEST;
}

int clock_gettime(clockid_t which, struct timespec *now) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int failed = real(which, now);
    if (!failed && which == CLOCK_REALTIME) now->tv_sec += jump(now);
    return failed;
}

time_t time(time_t *told) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (told) *told = now.tv_sec;
    return now.tv_sec;
}
