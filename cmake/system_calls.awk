# Finds sources of the client library that call a system by themselves: headers, functions and macros of POSIX, Linux
# or Windows. Those stand in net/sockets_linux.cpp and net/sockets_windows.cpp alone, so that the library is the same
# sources on both; all others use the C++ library, and ENet, libsodium and Bullet. So do those of libtessera-connect, with
# libcurl, but for the socket of a user's own control plane.
#
#   awk -f cmake/system_calls.awk FILE...              prints a line for each, and exits with 1 if there is one
#
# A function that only a header of a system declares is found by that header. Those that headers of C and C++ declare
# beside their own are found by name.

BEGIN {
  headers = "^# *include <((sys|arpa|netinet|linux|asm|net)/[^>]*|" \
            "(aio|dirent|dlfcn|err|fcntl|grp|ifaddrs|iconv|langinfo|netdb|poll|pthread|pwd|sched|semaphore|signal|" \
            "spawn|strings|syslog|termios|ucontext|unistd|utime|" \
            "direct|io|process|windows|winsock2?|ws2tcpip|mswsock)[.]h|cerrno|csignal)>"
  functions = "(^|[^A-Za-z0-9_])(clock_gettime|fdopen|fileno|flockfile|getenv|gettimeofday|gmtime_r|localtime_r|" \
              "mkdtemp|mkostemp|mkstemp|nanosleep|open_memstream|popen|posix_memalign|putenv|rand_r|realpath|" \
              "secure_getenv|setenv|strdup|strerror(_r)?|strsignal|strtok_r|timegm|unsetenv|usleep) *[(]"
  macros = "(^|[^A-Za-z0-9_])(errno|_WIN32|_WIN64|__MINGW32__|__linux__|__unix__|_GNU_SOURCE)([^A-Za-z0-9_]|$)"
}
FILENAME ~ /(^|\/)net\/sockets(_linux\.cpp|_windows\.cpp|\.h)$/ { next }
FILENAME ~ /(^|\/)(client_sdk\/connect\/own_door_linux\.cpp|host\/control_socket\.h)$/ { next }
FILENAME ~ /(^|\/)include\/tessera\// { next }  # the C interface: how its functions are exported, and nothing else
{
  line = $0
  wrong = line ~ headers
  if (line !~ /^# *include/) {
    gsub(/"([^"\\]|\\.)*"/, "\"\"", line)
    sub(/\/\/.*/, "", line)
    wrong = line ~ macros || line ~ functions
  }
  if (!wrong) next
  sub(/^ +/, "", line)
  printf "%s:%d: names a system outside net/sockets_*.cpp: %s\n", FILENAME, FNR, line
  failed = 1
}
END { exit failed }
