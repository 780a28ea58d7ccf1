/* command.h - what main.c knows of a command. */
#ifndef SKINSPEC_CLI_COMMAND_H
#define SKINSPEC_CLI_COMMAND_H

/* Each returns the exit status: 0 done, 1 failed; usage errors exit with 2. */
int cmd_bench(int argc, char **argv);
int cmd_calibrate(int argc, char **argv);
int cmd_check(int argc, char **argv);
int cmd_coefficients(int argc, char **argv);
int cmd_convert(int argc, char **argv);
int cmd_demo(int argc, char **argv);
int cmd_devices(int argc, char **argv);
int cmd_dipole(int argc, char **argv);
int cmd_doctor(int argc, char **argv);
int cmd_export(int argc, char **argv);
int cmd_history(int argc, char **argv);
int cmd_map(int argc, char **argv);
int cmd_match(int argc, char **argv);
int cmd_measure(int argc, char **argv);
int cmd_reflectance(int argc, char **argv);
int cmd_replay(int argc, char **argv);
int cmd_status(int argc, char **argv);
int cmd_store(int argc, char **argv);
int cmd_table(int argc, char **argv);
int cmd_table2(int argc, char **argv);
int cmd_watch(int argc, char **argv);

/* Of `skinspec store`; argv[0] is the name after it. */
int cmd_subjects(int argc, char **argv);
int cmd_add_subject(int argc, char **argv);
int cmd_forget_subject(int argc, char **argv);

#endif
