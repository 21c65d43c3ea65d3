/* Preloaded: shifts the wall clock of a process by the seconds in the file $CLOCK_SHIFT.

   Waiting until a time of that clock lasts as it would where the clock itself is set: until the
   shifted clock gets there, also when it is shifted meanwhile. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

enum { SLICE = 20000000 }; /* ns between two looks at the shift */
static const volatile long long *shift; /* s */

__attribute__((constructor)) static void open_shift(void)
{
    const char *name = getenv("CLOCK_SHIFT");
    int file = name ? open(name, O_RDONLY) : -1;
    if (file < 0)
        return;
    void *page = mmap(NULL, sizeof *shift, PROT_READ, MAP_SHARED, file, 0);
    if (page != MAP_FAILED)
        shift = page;
    close(file);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    int failed = (int)syscall(SYS_clock_gettime, clock, now);
    if (!failed && shift && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        now->tv_sec += *shift;
    return failed;
}

int gettimeofday(struct timeval *restrict now, void *restrict zone)
{
    struct timespec t;
    (void)zone;
    if (clock_gettime(CLOCK_REALTIME, &t))
        return -1;
    now->tv_sec = t.tv_sec;
    now->tv_usec = t.tv_nsec / 1000;
    return 0;
}

time_t time(time_t *now)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    if (now)
        *now = t.tv_sec;
    return t.tv_sec;
}

/* Deadlines of the steady clock come here too, from who chose it; they count from the boot. */
static int is_wall(const struct timespec *end)
{
    return shift && end->tv_sec > 1000000000;
}

static struct timespec unshifted(const struct timespec *end)
{
    struct timespec real = *end;
    real.tv_sec -= *shift;
    return real;
}

int pthread_cond_timedwait(pthread_cond_t *restrict condition, pthread_mutex_t *restrict mutex,
                           const struct timespec *restrict end)
{
    static int (*wait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
    if (!wait)
        wait = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    if (!is_wall(end))
        return wait(condition, mutex, end);
    for (;;) {
        struct timespec real = unshifted(end), now;
        syscall(SYS_clock_gettime, CLOCK_REALTIME, &now);
        now.tv_nsec += SLICE;
        if (now.tv_nsec >= 1000000000) {
            now.tv_nsec -= 1000000000;
            now.tv_sec++;
        }
        int is_last = real.tv_sec < now.tv_sec ||
                      (real.tv_sec == now.tv_sec && real.tv_nsec <= now.tv_nsec);
        if (!is_last)
            real = now;
        int failed = wait(condition, mutex, &real);
        if (failed != ETIMEDOUT || is_last)
            return failed;
    }
}

int pthread_mutex_timedlock(pthread_mutex_t *restrict mutex, const struct timespec *restrict end)
{
    static int (*lock)(pthread_mutex_t *, const struct timespec *);
    if (!lock)
        lock = dlsym(RTLD_NEXT, "pthread_mutex_timedlock");
    struct timespec real = is_wall(end) ? unshifted(end) : *end;
    return lock(mutex, &real);
}

int sem_timedwait(sem_t *restrict semaphore, const struct timespec *restrict end)
{
    static int (*wait)(sem_t *, const struct timespec *);
    if (!wait)
        wait = dlsym(RTLD_NEXT, "sem_timedwait");
    struct timespec real = is_wall(end) ? unshifted(end) : *end;
    return wait(semaphore, &real);
}
