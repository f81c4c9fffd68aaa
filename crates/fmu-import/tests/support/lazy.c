/* Makes memory usable when it is first touched, as the runtimes of managed languages do: a fault that is no failure. */
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/mman.h>

static void make_usable(int number, siginfo_t *info, void *context) {
    uintptr_t page = (uintptr_t)info->si_addr & ~(uintptr_t)4095;
    (void)context;
    if (page == 0 || mprotect((void *)page, 4096, PROT_READ | PROT_WRITE) != 0) signal(number, SIG_DFL);
}
__attribute__((constructor)) static void install(void) {
    struct sigaction action = {.sa_sigaction = make_usable, .sa_flags = SA_SIGINFO | SA_ONSTACK};
    sigaction(SIGSEGV, &action, NULL);
}
