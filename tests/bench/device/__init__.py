"""What is to be learned of a GPU in ten minutes: parts in the order of their worth, each in a process of its own.

A part tells its rows one by one, and each is in the report at once: what hangs or crashes costs what it has not told.

run        the parts in turn, within a limit
part       one part, in a process of its own
report     the page of a report
subjects   what is compiled and rendered
host       the machine, its driver, its limits
probes     what arithmetic the compiler makes of GLSL
barriers   whether later commands see what a kernel wrote
compiling  how long kernels take: cold, and from other processes
shipped    pictures as the service traces them
edges      whether rays slip between triangles
looks      a server, its first pictures and its answers to edits
pictures   pictures beside those of llvmpipe
bits       the same bits however the work was cut
moves      what moving a picture's memory takes
floor      what a dispatch takes by pixels and samples
yielding   what waiting for the device costs the processor
blocks     records that are few in uniform blocks, or in storage buffers
pair       one and two processes on the device
"""
