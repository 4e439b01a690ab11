"""How far a picture is, and when it is finished.

progress    samples, time and noise of one picture, as they are reported
stop_rules  which rule ends a render
eta         how many samples are still needed, from the noise so far
noise       readings of the noise meter, not too often
"""
