"""The data folder: what users saved, what renders left, and how much room there is.

stores         the stores of the data folder, within one quota
database       the SQLite file: its version, its connections
migrations     its tables, as the ordered steps that made them
data_lock      one server at a time on a data folder
data_check     whether a data folder is sound
quota          room on the disk
documents      what users saved, in SQLite
callback_rows  which ends of renders are to be told to whom
asset_shares   what the assets of one key take
asset_access   which assets a key may use
lost_pictures  pictures of renders that the database does not know
"""
